#!/usr/bin/env python3
"""Renders gdpt's scenes with Mitsuba 3: for tests/mitsuba.rs, and, as a module, for benches/peers.

    python3 tests/mitsuba/render.py FOLDER

FOLDER/jobs.json is a list of {"scene", "depth", "runs", "spp"}, where FOLDER/scene.obj, .mtl and .toml are as gdpt
reads them. The pictures of a scene's runs go to FOLDER/scene.f32: one after the other, row by row from the top, red,
green and blue of each pixel as 32-bit floats of this machine.

Mitsuba gets the same triangles, materials, lights, camera, depth and box filter. Materials: Lambert, area lights,
conductors (Mitsuba has no Schlick: the same as gdpt's for Ks 1), smooth and rough glass.
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
            current[words[0]] = [float(w) for w in words[1:]]
    return materials


def split_obj(path, folder):
    """One OBJ file for each material, with the corners and normals that it uses."""
    vertices, normals, faces, material = [], [], {}, None
    for line in path.read_text().splitlines():
        words = line.split()
        if words[:1] == ["v"]:
            vertices.append(words[1:4])
        elif words[:1] == ["vn"]:
            normals.append(words[1:4])
        elif words[:1] == ["usemtl"]:
            material = words[1]
        elif words[:1] == ["f"]:
            corners = [(int(c.split("/")[0]), int(c.split("/")[2]) if c.count("/") == 2 else 0) for c in words[1:]]
            for i in range(1, len(corners) - 1):
                faces.setdefault(material, []).append((corners[0], corners[i], corners[i + 1]))
    files = {}
    for name, triangles in faces.items():
        used, lines, body = {}, [], []
        for triangle in triangles:
            corners = []
            for v, n in triangle:
                if (v, n) not in used:
                    used[v, n] = len(used) + 1
                    lines.append("v " + " ".join(vertices[v - 1]))
                    if n:
                        lines.append("vn " + " ".join(normals[n - 1]))
                i = used[v, n]
                corners.append(f"{i}//{i}" if n else str(i))
            body.append("f " + " ".join(corners))
        files[name] = folder / f"{path.stem}-{name}.obj"
        files[name].write_text("\n".join(lines + body) + "\n")
    return files


def rgb(value):
    return {"type": "rgb", "value": value}


def bsdf(m):
    alpha = m.get("Pr", [0.0])[0] ** 2
    rough = {"distribution": "ggx", "alpha": alpha} if alpha > 0 else {}
    prefix = "rough" if rough else ""
    if m.get("Pm", [0])[0] >= 1 or m.get("illum", [0])[0] == 3:
        metal = {"type": prefix + "conductor", "material": "none", "specular_reflectance": rgb(m["Ks"])}
        return {"type": "twosided", "inner": metal | rough}
    if m.get("illum", [0])[0] in (5, 6, 7, 9):
        return {"type": prefix + "dielectric", "int_ior": m.get("Ni", [1.5])[0], "ext_ior": 1.0,
                "specular_transmittance": rgb(m.get("Tf", [1.0] * 3))} | rough
    return {"type": "twosided", "inner": {"type": "diffuse", "reflectance": rgb(m.get("Kd", [0.5] * 3))}}


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
            shape["bsdf"] = bsdf(m)
        scene[f"shape_{name}"] = shape
    radiance = toml.get("environment", {}).get("radiance")
    if radiance:
        scene["sky"] = {"type": "constant", "radiance": rgb(radiance)}
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
