//! What becomes of a camera that is left open: the scene fills the picture, seen from the side that is asked
//! for, the right way up.

mod bodies;
mod rooms;

use crate::common::lambert;
use bodies::Body;
use gdpt::error::Warnings;
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::{CameraTable, Up, View};
use gdpt::scene::camera::Camera;
use gdpt::scene::up_axis::UpSource;
use gdpt::scene::{Scene, SceneSettings};
use glam::{Vec2, Vec3};
use std::path::Path;

fn build(body: Body, material: MtlMaterial, camera: CameraTable, size: (u32, u32)) -> Scene {
    let settings = SceneSettings {
        camera,
        size,
        environment: Vec3::ONE.into(),
        roughness_threshold: 0.01,
        ..Default::default()
    };
    let path = Path::new("test.obj");
    Scene::build(
        path,
        body.obj(material),
        &settings,
        &mut Warnings::new(false),
    )
    .unwrap()
}

fn scene(body: Body, camera: CameraTable) -> Scene {
    build(body, lambert(0.5), camera, (96, 64))
}

/// Where a point is in the picture, from -1 to 1 to the right and downwards.
fn place(camera: &Camera, point: Vec3) -> Vec2 {
    let middle = camera.direction(0.5 * camera.width as f32, 0.5 * camera.height as f32);
    let along = |x: f32, y: f32| {
        let d = camera.direction(x, y);
        d / d.dot(middle) - middle
    };
    let right = along(camera.width as f32, 0.5 * camera.height as f32);
    let down = along(0.5 * camera.width as f32, camera.height as f32);
    let to = point - camera.origin;
    let at = to / to.dot(middle);
    Vec2::new(
        at.dot(right) / right.length_squared(),
        at.dot(down) / down.length_squared(),
    )
}

/// The smallest and the largest place of a scene's vertices.
fn extent(scene: &Scene, camera: &Camera) -> (Vec2, Vec2) {
    let corners = scene.mesh.triangles.iter().flatten();
    let places = corners.map(|&c| place(camera, scene.mesh.positions[c as usize]));
    places.fold((Vec2::INFINITY, Vec2::NEG_INFINITY), |(low, high), p| {
        (low.min(p), high.max(p))
    })
}

/// The body touches the frame on two opposite sides, and stays 5 % inside on all.
fn assert_tight(what: &str, scene: &Scene, tolerance: f32) {
    let (low, high) = extent(scene, &scene.camera);
    let close = |x: f32| (x - 0.95).abs() < tolerance;
    let tight = |low: f32, high: f32| close(-low) && close(high);
    assert!(
        tight(low.x, high.x) || tight(low.y, high.y),
        "{what}: {low} {high}"
    );
    let largest = low.abs().max(high.abs()).max_element();
    assert!(largest < 0.95 + tolerance, "{what}: {low} {high}");
}

const VIEWS: [View; 7] = [
    View::ThreeQuarter,
    View::Front,
    View::Back,
    View::Left,
    View::Right,
    View::Top,
    View::Bottom,
];

#[test]
fn every_side_fills_the_picture() {
    let shapes = [
        bodies::table(),
        bodies::person(true),
        bodies::house(0.3, true).and(bodies::ground(10.0)),
        // Far from the origin, as in maps: coordinates have steps of 1/128.
        {
            let mut far = bodies::table();
            far.positions
                .iter_mut()
                .for_each(|p| *p += Vec3::new(4e4, -300.0, 7e4));
            far
        },
    ];
    for (index, body) in shapes.into_iter().enumerate() {
        for view in VIEWS {
            for size in [(64, 64), (192, 64), (64, 192)] {
                for up in ["y", "-y", "z", "x"] {
                    let camera = CameraTable {
                        view: Some(view),
                        up: Some(up.parse().unwrap()),
                        fov: Some([20.0, 40.0, 50.0][index % 3]),
                        ..Default::default()
                    };
                    let scene = build(body.clone(), lambert(0.5), camera, size);
                    let tolerance = if index == 3 { 0.02 } else { 1e-3 };
                    assert_tight(
                        &format!("{index} {view:?} {size:?} {up}"),
                        &scene,
                        tolerance,
                    );
                }
            }
        }
    }
}

/// Where a wide field of view would have the camera in a corner of the scene, it keeps away.
#[test]
fn a_wide_view_keeps_its_distance() {
    let camera = CameraTable {
        fov: Some(100.0),
        ..Default::default()
    };
    let body = bodies::house(0.3, true).and(bodies::ground(10.0));
    let scene = build(body, lambert(0.5), camera, (192, 64));
    let (low, high) = extent(&scene, &scene.camera);
    assert!(low.min_element() > -0.951 && high.max_element() < 0.951);
    let nearest = scene.mesh.positions.iter().take(20);
    let nearest = nearest.map(|p| p.distance(scene.camera.origin));
    assert!(nearest.fold(f32::INFINITY, f32::min) > 1.0);
}

/// The camera's direction from a unit cube for a view, and what is upwards in the picture.
fn looks(table: CameraTable) -> (Vec3, Vec3) {
    let cube = Body::default().block([-0.5; 3], [0.5; 3]);
    let camera = scene(cube, table).camera;
    let (x, y) = (48.0, 32.0);
    let middle = camera.direction(x, y);
    let above = camera.direction(x, 0.0);
    (middle, (above - middle * above.dot(middle)).normalize())
}

#[test]
fn sides_are_where_their_names_say() {
    let wanted = [
        (View::Front, Vec3::NEG_Z, Vec3::Y),
        (View::Back, Vec3::Z, Vec3::Y),
        (View::Left, Vec3::X, Vec3::Y),
        (View::Right, Vec3::NEG_X, Vec3::Y),
        (View::Top, Vec3::NEG_Y, Vec3::NEG_Z),
        (View::Bottom, Vec3::Y, Vec3::Z),
    ];
    for (view, forward, up) in wanted {
        let table = CameraTable {
            view: Some(view),
            ..Default::default()
        };
        let (f, u) = looks(table.clone());
        assert!(
            (f - forward).length() < 1e-5 && (u - up).length() < 1e-5,
            "{view:?}: {f} {u}"
        );
        // With z upwards the front is towards -y: all is turned about x.
        let turn = |v: Vec3| Vec3::new(v.x, -v.z, v.y);
        let (f, u) = looks(CameraTable {
            up: Some(Up::Along([0.0, 0.0, 1.0])),
            ..table
        });
        let close = (f - turn(forward)).length() < 1e-5 && (u - turn(up)).length() < 1e-5;
        assert!(close, "{view:?}, z up: {f} {u}");
    }
    // By angles; they win over the view's.
    let (f, _) = looks(CameraTable {
        azimuth: Some(90.0),
        elevation: Some(0.0),
        ..Default::default()
    });
    assert!((f - Vec3::NEG_X).length() < 1e-5);
    let (f, _) = looks(CameraTable {
        view: Some(View::Left),
        elevation: Some(45.0),
        ..Default::default()
    });
    assert!((f - Vec3::new(1.0, -1.0, 0.0).normalize()).length() < 1e-5);
    // Of nothing known: from the front, the right and above.
    let (f, u) = looks(CameraTable::default());
    assert!(
        f.z < -0.7 && f.x < -0.3 && f.y < -0.2 && u.y > 0.9,
        "{f} {u}"
    );
}

#[test]
fn what_is_given_of_a_camera_holds() {
    let body = bodies::table();
    let target = Vec3::new(1.0, 0.75, 0.5);
    let seen = scene(
        body.clone(),
        CameraTable {
            target: Some(target.to_array()),
            view: Some(View::Front),
            ..Default::default()
        },
    );
    // The target in the middle, and all in the picture, to its border on one side.
    assert!(place(&seen.camera, target).length() < 1e-4);
    let (low, high) = extent(&seen, &seen.camera);
    let largest = low.abs().max(high.abs()).max_element();
    assert!((largest - 0.95).abs() < 1e-3, "{low} {high}");

    let origin = [0.0, 1.0, 5.0];
    let from = |table: CameraTable| scene(bodies::table(), table).camera;
    let seen = from(CameraTable {
        origin: Some(origin),
        ..Default::default()
    });
    assert_eq!(seen.origin, Vec3::from(origin));
    assert!(place(&seen, Vec3::new(0.0, 0.375, 0.0)).length() < 1e-4);
    // In the very middle, straight down, and straight up: there is a picture all the same.
    for (origin, target) in [
        ([0.0, 0.375, 0.0], None),
        ([0.0, 5.0, 0.0], Some([0.0, 0.0, 0.0])),
        ([0.0, -5.0, 0.0], Some([0.0, 0.0, 0.0])),
    ] {
        from(CameraTable {
            origin: Some(origin),
            target,
            ..Default::default()
        });
    }
    // Zoom: twice as large, about the middle of the picture.
    let table = CameraTable {
        view: Some(View::Right),
        ..Default::default()
    };
    let (one, two) = (
        from(table.clone()),
        from(CameraTable {
            zoom: Some(2.0),
            ..table
        }),
    );
    let corner = Vec3::new(1.0, 0.75, 0.5);
    assert!((place(&two, corner) - 2.0 * place(&one, corner)).length() < 1e-4);
}

#[test]
fn contradictions_and_impossible_sides_are_refused() {
    let file = || Body::default().block([-0.5; 3], [0.5; 3]).obj(lambert(0.5));
    let refused = |camera: CameraTable| {
        let settings = SceneSettings {
            camera,
            size: (8, 8),
            environment: Default::default(),
            roughness_threshold: 0.01,
            ..Default::default()
        };
        let path = Path::new("test.obj");
        let scene = Scene::build(path, file(), &settings, &mut Warnings::new(false));
        scene.err().map(|e| e.to_string()).unwrap_or_default()
    };
    let both = refused(CameraTable {
        origin: Some([0.0, 0.0, 5.0]),
        azimuth: Some(20.0),
        ..Default::default()
    });
    assert!(
        both.contains("origin") && both.contains("azimuth"),
        "{both}"
    );
    for elevation in [91.0, -90.5, f32::NAN] {
        let message = refused(CameraTable {
            elevation: Some(elevation),
            ..Default::default()
        });
        assert!(message.contains("-90 to 90"), "{message}");
    }
    assert!(
        !refused(CameraTable {
            azimuth: Some(f32::INFINITY),
            ..Default::default()
        })
        .is_empty()
    );
    assert!(
        !refused(CameraTable {
            zoom: Some(0.0),
            ..Default::default()
        })
        .is_empty()
    );
    assert!(
        !refused(CameraTable {
            up: Some(Up::Along([0.0; 3])),
            ..Default::default()
        })
        .is_empty()
    );
}

/// What flags say of the camera's place wins over what the TOML says of it, as a whole.
#[test]
fn the_nearer_table_says_where_the_camera_stands() {
    let toml = CameraTable {
        origin: Some([1.0, 2.0, 3.0]),
        target: Some([0.0; 3]),
        fov: Some(30.0),
        ..Default::default()
    };
    let flags = CameraTable {
        azimuth: Some(10.0),
        ..Default::default()
    };
    let both = flags.or(&toml);
    assert_eq!(
        (both.origin, both.target, both.fov),
        (None, None, Some(30.0))
    );
    let back = toml.or(&CameraTable {
        view: Some(View::Top),
        zoom: Some(3.0),
        ..Default::default()
    });
    assert_eq!(
        (back.view, back.zoom, back.origin),
        (None, Some(3.0), toml.origin)
    );
}

#[test]
fn a_turntable_has_all_of_the_scene_all_the_way_round() {
    for (up, body) in [("y", bodies::person(true)), ("z", bodies::table().z_up())] {
        let camera = CameraTable {
            up: Some(up.parse().unwrap()),
            all_around: true,
            ..Default::default()
        };
        let scene = scene(body, camera);
        let mut largest = 0.0f32;
        for step in 0..360 {
            let camera = scene.camera.turned((step as f32).to_radians());
            let (low, high) = extent(&scene, &camera);
            largest = largest.max(low.abs().max(high.abs()).max_element());
        }
        assert!(largest < 0.951 && largest > 0.9, "{up}: {largest}");
    }
}

fn decided(body: Body, material: MtlMaterial) -> (Vec3, UpSource) {
    let up = build(body, material, CameraTable::default(), (8, 8))
        .framing
        .up;
    (up.direction, up.source)
}

#[test]
fn what_stands_plainly_stands_upright() {
    for (name, body) in bodies::plain() {
        let y = decided(body.clone(), lambert(0.5));
        assert_eq!(y.0, Vec3::Y, "{name}, y up");
        let z = decided(body.z_up(), lambert(0.5));
        assert_eq!(z, (Vec3::Z, UpSource::Shape), "{name}, z up");
    }
}

#[test]
fn y_is_up_where_the_shape_does_not_say() {
    for (name, body) in bodies::undecidable() {
        let (up, _) = decided(body, lambert(0.5));
        assert_eq!(up, Vec3::Y, "{name}");
    }
    let sphere = Body::default().ball([0.0; 3], [1.0; 3]);
    assert_eq!(decided(sphere, lambert(0.5)).1, UpSource::Custom);
}

/// A lying floor or a standing wall: its name tells.
#[test]
fn floors_are_level() {
    let slab = || Body::default().block([-2.0, -2.0, 0.0], [2.0, 2.0, 0.4]);
    let named = |name: &str| MtlMaterial {
        name: name.to_owned(),
        ..lambert(0.5)
    };
    assert_eq!(decided(slab(), named("wall")).0, Vec3::Y);
    for name in ["Floor.001", "wood_floor", "ground", "Grass-02"] {
        assert_eq!(
            decided(slab(), named(name)),
            (Vec3::Z, UpSource::Shape),
            "{name}"
        );
    }
    assert_eq!(decided(slab(), named("background")).0, Vec3::Y);
}

#[test]
fn the_user_and_old_cameras_say_what_is_up() {
    let z_up = || bodies::table().z_up();
    let up = |camera: CameraTable| scene(z_up(), camera).framing.up.direction;
    assert_eq!(up(CameraTable::default()), Vec3::Z);
    assert_eq!(
        up(CameraTable {
            up: Some(Up::Auto),
            ..Default::default()
        }),
        Vec3::Z
    );
    assert_eq!(
        up(CameraTable {
            up: Some("y".parse().unwrap()),
            ..Default::default()
        }),
        Vec3::Y
    );
    // A camera with a place of its own and no word of what is up has always had y.
    let origin = Some([0.0, 3.0, 9.0]);
    assert_eq!(
        up(CameraTable {
            origin,
            ..Default::default()
        }),
        Vec3::Y
    );
    assert_eq!(
        up(CameraTable {
            origin,
            up: Some(Up::Auto),
            ..Default::default()
        }),
        Vec3::Z
    );
}
