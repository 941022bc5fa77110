//! Cameras whose place is open stand where most is seen: before open boxes, and in rooms with lamps.

use super::bodies::{self, Body, Face};
use crate::common::{Render, lambert, light, tracer};
use gdpt::error::Warnings;
use gdpt::load::lights::{Cone, PunctualLight};
use gdpt::load::mtl::MtlMaterial;
use gdpt::load::sidecar::{CameraTable, View};
use gdpt::scene::framing::Side;
use gdpt::scene::{Scene, SceneSettings};
use gdpt::vantage;
use glam::Vec3;
use std::path::Path;

/// Parts, each of a material of its own; without lamps under a white sky.
fn scene(parts: Vec<(Body, MtlMaterial)>, camera: CameraTable) -> Scene {
    scene_with(parts, camera, &[])
}

/// With lights that have no extent, too.
fn scene_with(
    parts: Vec<(Body, MtlMaterial)>,
    camera: CameraTable,
    lights: &[PunctualLight],
) -> Scene {
    let lamps = !lights.is_empty() || parts.iter().any(|(_, m)| m.ke.is_some());
    let mut file = Body::default().obj(lambert(0.5));
    file.materials.clear();
    for (body, material) in parts {
        let first = file.positions.len() as u32;
        file.positions.extend(body.positions);
        let index = file.materials.len() as u32;
        file.material_of.extend(vec![index; body.triangles.len()]);
        let moved = body.triangles.into_iter().map(|t| t.map(|c| c + first));
        file.triangles.extend(moved);
        file.materials.push(material);
    }
    let settings = SceneSettings {
        camera,
        size: (96, 64),
        environment: if lamps { Vec3::ZERO } else { Vec3::ONE }.into(),
        lights: lights.to_vec(),
        roughness_threshold: 0.01,
    };
    let path = Path::new("test.obj");
    Scene::build(path, file, &settings, &mut Warnings::new(false)).unwrap()
}

fn lamp(low: [f32; 3], high: [f32; 3]) -> (Body, MtlMaterial) {
    (Body::default().block(low, high), light(10.0))
}

/// The side from which the settled camera looks, and the note.
fn settled(mut scene: Scene) -> (Scene, Side, Option<&'static str>) {
    let tracer = tracer(&scene);
    let note = vantage::settle(&mut scene, &*tracer).unwrap();
    let side = scene.framing.side_of(&scene.camera);
    (scene, side, note)
}

fn is_inside(scene: &Scene) -> bool {
    let (low, high) = scene.mesh.bounds;
    let origin = scene.camera.origin;
    origin.cmpgt(low).all() && origin.cmplt(high).all()
}

/// The part of the pixels whose surfaces have light.
fn lit(scene: &Scene) -> f64 {
    let render = Render {
        spp: 16,
        ..Render::default()
    };
    let film = render.film(scene, &*tracer(scene));
    let picture = gdpt::picture::of_film(&film, gdpt::reconstruct::Method::Primal).image;
    let lit = (0..96 * 64).filter(|&i| picture.get(i).max_element() > 0.01);
    lit.count() as f64 / (96.0 * 64.0)
}

#[test]
fn what_is_open_to_no_side_is_seen_from_three_quarters() {
    for (name, body) in bodies::plain() {
        // Those are open to a side.
        if name.contains("room") {
            continue;
        }
        let camera = CameraTable::default();
        let (_, side, note) = settled(scene(vec![(body, lambert(0.5))], camera));
        assert_eq!(note, None, "{name}");
        // Of what is as thin as a street lamp, the area is a matter of luck.
        let usual = (side.azimuth - 30.0).abs() < 0.1 && (side.elevation - 20.0).abs() < 0.1;
        assert!(usual || name == "street lamp", "{name}: {side:?}");
    }
}

#[test]
fn open_boxes_are_seen_from_their_open_side() {
    let furnished = |skip: &[Face]| bodies::room(skip).and(bodies::table());
    // With a lamp, and under the sky.
    let lamps = [Some(lamp([-0.5, 2.5, -0.5], [0.5, 2.55, 0.5])), None];
    for lamp in lamps {
        let look = |skip: &[Face]| {
            let parts = [(furnished(skip), lambert(0.7))]
                .into_iter()
                .chain(lamp.clone());
            settled(scene(parts.collect(), CameraTable::default()))
        };
        let (scene, side, note) = look(&[Face::Front]);
        assert!(
            side.azimuth.abs() < 1.0 && side.elevation < 15.0,
            "front: {side:?}"
        );
        assert!(note.is_none() && lit(&scene) > 0.5, "{}", lit(&scene));
        let (_, side, _) = look(&[Face::Left]);
        assert!((-120.0..-50.0).contains(&side.azimuth), "left: {side:?}");
        let (_, side, _) = look(&[Face::Back]);
        assert!(side.azimuth.abs() > 140.0, "back: {side:?}");
        let (_, side, _) = look(&[Face::Top]);
        assert!(side.elevation > 40.0, "above: {side:?}");
    }
}

#[test]
fn a_closed_room_with_lamps_is_seen_from_within() {
    let walls = [
        // Walls that face inwards, outwards, and thick ones.
        bodies::room(&[]),
        bodies::room(&[]).inside_out(),
        bodies::room(&[]).and(Body::default().block([-3.2, -0.2, -2.7], [3.2, 2.8, 2.7])),
    ];
    for (index, walls) in walls.into_iter().enumerate() {
        for z_up in [false, true] {
            let lamp = lamp([-0.5, 2.4, -0.5], [0.5, 2.45, 0.5]);
            let mut parts = vec![
                (walls.clone(), lambert(0.7)),
                (bodies::table(), lambert(0.5)),
                lamp,
            ];
            if z_up {
                parts = parts.into_iter().map(|(b, m)| (b.z_up(), m)).collect();
            }
            let camera = CameraTable {
                up: Some(if z_up { "z" } else { "y" }.parse().unwrap()),
                ..Default::default()
            };
            let (scene, _, note) = settled(scene(parts, camera));
            assert!(note.is_some_and(|n| n.contains("inside")), "{index} {z_up}");
            assert!(is_inside(&scene), "{index} {z_up}: {}", scene.camera.origin);
            assert!(lit(&scene) > 0.95, "{index} {z_up}");
        }
    }
}

/// Lamps in shades of glass: no light sample gets through, but paths do.
#[test]
fn a_room_lit_through_glass_is_seen_from_within() {
    let glass = MtlMaterial {
        ni: Some(1.5),
        illum: Some(7),
        ..MtlMaterial::default()
    };
    let shade = Body::default().block([-0.7, 1.9, -0.7], [0.7, 2.5, 0.7]);
    let parts = vec![
        (bodies::room(&[]), lambert(0.7)),
        (shade, glass),
        lamp([-0.4, 2.1, -0.4], [0.4, 2.3, 0.4]),
    ];
    let (scene, _, note) = settled(scene(parts, CameraTable::default()));
    assert!(note.is_some() && is_inside(&scene));
    assert!(lit(&scene) > 0.5);
}

/// A spot and a point in a closed room light it as a lamp does; a directional light shines on its outside.
#[test]
fn lights_without_extent_count_as_lamps() {
    let room = || vec![(bodies::room(&[]).and(bodies::table()), lambert(0.7))];
    let at = |position, cone| PunctualLight::Point {
        position,
        intensity: [5.0; 3],
        cone,
    };
    let cone = Cone {
        direction: [0.0, -1.0, 0.0],
        cutoff_angle: 70.0,
        beam_width: 60.0,
    };
    for light in [at([0.3, 2.3, 0.2], None), at([0.3, 2.3, 0.2], Some(cone))] {
        let (scene, _, note) = settled(scene_with(room(), CameraTable::default(), &[light]));
        assert!(note.is_some() && is_inside(&scene));
        assert!(lit(&scene) > 0.5);
    }
    // From the left and above.
    let sun = PunctualLight::Directional {
        direction: [1.0, -0.3, 0.0],
        irradiance: [2.0; 3],
    };
    let body = Body::default().block([-1.0; 3], [1.0; 3]);
    let parts = vec![(body, lambert(0.7))];
    let (scene, side, note) = settled(scene_with(parts, CameraTable::default(), &[sun]));
    assert!(note.is_none() && !is_inside(&scene));
    assert!(side.azimuth < 0.0 && lit(&scene) > 0.3, "{side:?}");
}

#[test]
fn inside_is_inside_and_looks_where_it_should() {
    let room = || vec![(bodies::room(&[]).and(bodies::table()), lambert(0.7))];
    let inside = |azimuth: Option<f32>| {
        let camera = CameraTable {
            view: Some(View::Inside),
            azimuth,
            ..Default::default()
        };
        settled(scene(room(), camera))
    };
    let (scene, ..) = inside(None);
    assert!(is_inside(&scene));
    // At the height of eyes in a room 2.6 high, with the far wall farther than the near one.
    let height = scene.camera.origin.y;
    assert!((1.0..1.8).contains(&height), "{height}");
    let (scene, side, _) = inside(Some(90.0));
    assert!(
        is_inside(&scene) && (side.azimuth - 90.0).abs() < 0.1,
        "{side:?}"
    );
}

/// A place that the user gives is kept, be it dark.
#[test]
fn given_cameras_stay() {
    let tables = [
        CameraTable {
            origin: Some([0.0, 1.0, 9.0]),
            ..Default::default()
        },
        CameraTable {
            view: Some(View::ThreeQuarter),
            ..Default::default()
        },
    ];
    for table in tables {
        let lamp = lamp([-0.5, 2.4, -0.5], [0.5, 2.45, 0.5]);
        let mut scene = scene(vec![(bodies::room(&[]), lambert(0.7)), lamp], table);
        let before = scene.camera.clone();
        let tracer = tracer(&scene);
        let note = vantage::settle(&mut scene, &*tracer).unwrap();
        assert_eq!((note, before), (None, scene.camera.clone()));
        assert_eq!(lit(&scene), 0.0);
    }
}
