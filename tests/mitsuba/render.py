#!/usr/bin/env python3
"""Renders gdpt's scenes with Mitsuba 3: for tests/physics/mitsuba.rs, and, as a module, for benches/peers.

    python3 tests/mitsuba/render.py FOLDER

FOLDER/jobs.json is a list of {"scene", "depth", "runs", "spp"}, where FOLDER/scene.obj, .mtl and .toml are as gdpt
reads them. The pictures of a scene's runs go to FOLDER/scene.f32: one after the other, row by row from the top, red,
green and blue of each pixel as 32-bit floats of this machine.

Mitsuba gets the same triangles, materials, lights, camera, depth and box filter. Materials: Lambert, plain, textured
and half open, area lights, conductors (Mitsuba has no Schlick: the same as gdpt's for Ks 1), smooth and rough glass.
What is named `pane` is on open sheets: thin glass (without Tf, which Mitsuba takes otherwise). Light of constant
environments and of maps, and lights without extent.
"""
import array
import json
import pathlib
import sys

try:
    import tomllib
except ImportError:
    sys.exit("needs Python 3.11 or later")


def read_mtl(path):
    materials, current = {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["newmtl"]:
            current = materials.setdefault(words[1], {})
        elif len(words) > 1 and current is not None and words[0] != "#":
            current[words[0]] = words[-1] if words[0] == "map_Kd" else [float(w) for w in words[1:]]
    return materials


def split_obj(path, folder):
    """One OBJ file for each material, with the corners, texture coordinates and normals that it uses."""
    given, faces, material = {"v": [], "vt": [], "vn": []}, {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] and words[0] in given:
            given[words[0]].append(" ".join(words[1:4]))
        elif words[:1] == ["usemtl"]:
            material = words[1]
        elif words[:1] == ["f"]:
            corners = [tuple(int(i or 0) for i in (c + "//").split("/")[:3]) for c in words[1:]]
            for i in range(1, len(corners) - 1):
                faces.setdefault(material, []).extend((corners[0], corners[i], corners[i + 1]))
    files = {}
    for name, corners in faces.items():
        used = {corner: i for i, corner in enumerate(dict.fromkeys(corners), 1)}
        there = [key for key, indices in zip(given, zip(*used)) if all(indices)]
        lines = [f"{key} {given[key][i - 1]}" for corner in used for key, i in zip(given, corner) if key in there]
        form = "/".join("%d" if key in there else "" for key in given).rstrip("/")
        corners = [form.replace("%d", str(used[corner])) for corner in corners]
        lines += ["f " + " ".join(corners[i:i + 3]) for i in range(0, len(corners), 3)]
        files[name] = folder / f"{path.stem}-{name}.obj"
        files[name].write_text("\n".join(lines) + "\n")
    return files


def rgb(value):
    return {"type": "rgb", "value": value}


def bsdf(name, m, folder):
    alpha = m.get("Pr", [0.0])[0] ** 2
    rough = {"distribution": "ggx", "alpha": alpha} if alpha > 0 else {}
    prefix = "rough" if rough else ""
    if m.get("Pm", [0])[0] >= 1 or m.get("illum", [0])[0] in (3, 5, 8):
        metal = {"type": prefix + "conductor", "material": "none", "specular_reflectance": rgb(m["Ks"])}
        return {"type": "twosided", "inner": metal | rough}
    if m.get("illum", [0])[0] in (6, 7, 9):
        indices = {"int_ior": m.get("Ni", [1.5])[0], "ext_ior": 1.0}
        if name == "pane":
            return {"type": "thindielectric"} | indices
        # Half of Tf, by its exponent, at each boundary.
        tint = [t ** 0.5 for t in m.get("Tf", [1.0] * 3)]
        return {"type": prefix + "dielectric", "specular_transmittance": rgb(tint)} | indices | rough
    reflectance = rgb(m.get("Kd", [0.5] * 3))
    if "map_Kd" in m:  # bilinear and repeated, as here; Mitsuba's OBJ has v upwards too
        reflectance = {"type": "bitmap", "filename": str(folder / m["map_Kd"])}
    diffuse = {"type": "twosided", "inner": {"type": "diffuse", "reflectance": reflectance}}
    return {"type": "mask", "opacity": m["d"][0], "nested": diffuse} if "d" in m else diffuse


def envmap(mi, path, rotation=0.0, scale=1.0):
    """gdpt's rows are centred at (row + 0.5)/h; Mitsuba's first and last lie on the poles. Twice as many rows and one
    are bilinearly the same."""
    bitmap = mi.Bitmap(str(path)).convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.Float32, srgb_gamma=False)
    texels = mi.TensorXf(bitmap)
    height, width, _ = texels.shape
    texels = list(texels.array)
    rows = [texels[3 * width * y:3 * width * (y + 1)] for y in range(height)]
    fine = []
    for y in range(2 * height + 1):
        above, below = rows[max(y - 1, 0) // 2], rows[min(y // 2, height - 1)]
        fine += [(a + b) / 2 for a, b in zip(above, below)]
    bitmap = mi.Bitmap(mi.TensorXf(fine, shape=(2 * height + 1, width, 3)))
    return {"type": "envmap", "bitmap": bitmap, "scale": scale,
            "to_world": mi.ScalarTransform4f().rotate([0, 1, 0], rotation)}


def punctual(mi, light):
    colour = lambda value: rgb(value if isinstance(value, list) else [value] * 3)
    if light["kind"] == "directional":
        return {"type": "directional", "direction": light["direction"], "irradiance": colour(light["irradiance"])}
    intensity = colour(light["intensity"])
    if light["kind"] == "point":
        return {"type": "point", "position": light["position"], "intensity": intensity}
    to_world = mi.ScalarTransform4f().look_at(light["position"], light["target"], [0.1, 1, 0.2])
    return {"type": "spot", "to_world": to_world, "intensity": intensity,
            "cutoff_angle": light["cutoff_angle"], "beam_width": light["beam_width"]}


def describe(mi, obj, folder, size=None, **integrator):
    """What `mi.load_dict` makes the scene of; `folder` is for its parts, `integrator` for parameters of `path`."""
    toml = tomllib.loads(obj.with_suffix(".toml").read_text())
    camera = toml["camera"]
    width, height = size or (toml["film"]["width"], toml["film"]["height"])
    scene = {
        "type": "scene",
        "integrator": {"type": "path"} | integrator,
        "sensor": {
            "type": "perspective",
            "fov": camera["fov"],
            "fov_axis": "y",
            "to_world": mi.ScalarTransform4f().look_at(camera["origin"], camera["target"], camera["up"]),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"},
                     "pixel_format": "rgb", "component_format": "float32"},
            "sampler": {"type": "independent"},
        },
    }
    materials = read_mtl(obj.with_suffix(".mtl"))
    for name, path in split_obj(obj, folder).items():
        m = materials[name]
        shape = {"type": "obj", "filename": str(path), "face_normals": "vn " not in path.read_text()}
        if any(m.get("Ke", [0])):
            shape["emitter"] = {"type": "area", "radiance": rgb(m["Ke"])}
            shape["bsdf"] = {"type": "diffuse", "reflectance": rgb([0, 0, 0])}
        else:
            shape["bsdf"] = bsdf(name, m, obj.parent)
        scene[f"shape_{name}"] = shape
    for number, light in enumerate(toml.get("lights", [])):
        scene[f"light_{number}"] = punctual(mi, light)
    environment = toml.get("environment", {})
    if "map" in environment:
        path = obj.parent / environment["map"]
        scene["sky"] = envmap(mi, path, environment.get("rotation", 0.0), environment.get("scale", 1.0))
    elif "radiance" in environment:
        scene["sky"] = {"type": "constant", "radiance": rgb(environment["radiance"])}
    return scene


def main(folder):
    import mitsuba as mi

    mi.set_variant("scalar_rgb")
    for job in json.loads((folder / "jobs.json").read_text()):
        # Without roulette. Optimizing would shuffle the lights, from process to process.
        scene = describe(mi, folder / f"{job['scene']}.obj", folder, max_depth=job["depth"], rr_depth=1000)
        # Mitsuba's ldsampler is biased; this one halves the error of `independent`. It needs a square number.
        scene["sensor"]["sampler"] = {"type": "stratified", "sample_count": job["spp"]}
        scene = mi.load_dict(scene, optimize=False)
        with open(folder / f"{job['scene']}.f32", "wb") as out:
            for run in range(job["runs"]):
                array.array("f", mi.render(scene, spp=job["spp"], seed=run).array).tofile(out)


if __name__ == "__main__":
    main(pathlib.Path(sys.argv[1]))
