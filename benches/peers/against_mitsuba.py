#!/usr/bin/env python3
"""Renders a scene with gdpt and with Mitsuba 3, and prints samples per second and efficiency of both in one run.

    pip install mitsuba OpenEXR numpy
    cargo build --release
    python3 benches/peers/against_mitsuba.py scenes/cornell.obj [--spp 64] [--depth 12] [--size 256x256] [--runs 3]

Mitsuba's llvm variant needs an LLVM that knows the processor; on Debian 12 with AVX-512 that is libllvm19, named by
DRJIT_LIBLLVM_PATH=/usr/lib/x86_64-linux-gnu/libLLVM-19.so.

Mitsuba gets the same triangles, materials, light, camera, depth and box filter; its path integrator has light
sampling and BSDF sampling under MIS, as `gdpt render --method pt` has. Roulette begins at depth 5 there, at
vertex 4 here. Errors are relMSE against two independent gdpt references (method of differences: the references' own
noise cancels). Efficiency is 1/(relMSE x seconds). Rendering alone is timed: no loading, building or writing.
Runs of all programs take turns; medians are printed. Materials: Lambert, area lights, conductors with F0 = Ks by
Schlick at roughness 0 (Mitsuba's mirror has no Fresnel term, so means differ a little), smooth and rough glass.
"""
import argparse
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

import numpy as np
import OpenEXR

sys.path.append(str(pathlib.Path(__file__).resolve().parents[2] / "tests/mitsuba"))
import render


def read_exr(path):
    with OpenEXR.File(str(path), separate_channels=True) as file:
        channels = file.channels()
        return np.stack([channels[c].pixels for c in "RGB"], -1).astype(np.float64)


def child_mitsuba(args):
    """In a process of its own: Mitsuba's variants do not share one. Prints a JSON line for each run asked for on stdin."""
    import mitsuba as mi

    mi.set_variant(args.variant)
    import drjit as dr

    if args.variant.startswith("llvm"):
        dr.set_thread_count(args.threads)
    with tempfile.TemporaryDirectory() as folder:
        scene = render.describe(mi, args.scene.resolve(), pathlib.Path(folder), args.size, max_depth=args.depth)
        scene = mi.load_dict(scene)
        mi.render(scene, spp=4, seed=99)  # compiles the kernels
        for seed, line in enumerate(sys.stdin):
            start = time.perf_counter()
            image = np.array(mi.render(scene, spp=args.spp, seed=seed))
            seconds = time.perf_counter() - start
            np.save(line.strip(), image.astype(np.float64))
            print(json.dumps({"seconds": seconds}), flush=True)


def gdpt(args, out, method, seed, spp):
    stats = out.with_suffix(".json")
    size = f"{args.size[0]}x{args.size[1]}"
    subprocess.run(
        [str(args.gdpt), "render", str(args.scene), "-o", str(out), "--stats", str(stats), "--quiet", "--method", method,
         "--seed", str(seed), "--spp", str(spp), "--depth", str(args.depth), "--size", size,
         "--threads", str(args.threads)], check=True)
    s = json.loads(stats.read_text())
    return read_exr(out), s["seconds_tracing"] + s["seconds_solving"]


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scene", type=pathlib.Path)
    parser.add_argument("--spp", type=int, default=64)
    parser.add_argument("--reference-spp", type=int, default=1024)
    parser.add_argument("--depth", type=int, default=12)
    parser.add_argument("--size", type=lambda s: tuple(int(n) for n in s.split("x")), default=(256, 256))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--gdpt", type=pathlib.Path, default=pathlib.Path("target/release/gdpt"))
    parser.add_argument("--variant", help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.variant:
        return child_mitsuba(args)

    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        references = [gdpt(args, folder / f"r{i}.exr", "gpt", 1000 + i, args.reference_spp)[0] for i in (1, 2)]
        denominator = ((references[0] + references[1]) / 2) ** 2 + 0.01
        rel_mse = lambda image: float((((image - references[0]) * (image - references[1])) / denominator).mean())

        children = {}
        for variant in ("scalar_rgb", "llvm_ad_rgb"):
            command = [sys.executable, __file__, str(args.scene), "--variant", variant, "--spp", str(args.spp),
                       "--depth", str(args.depth), "--size", f"{args.size[0]}x{args.size[1]}",
                       "--threads", str(args.threads)]
            children[variant] = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        results = {}
        for run in range(args.runs):
            for method in ("pt", "gpt"):
                image, seconds = gdpt(args, folder / "g.exr", method, run, args.spp)
                results.setdefault(f"gdpt {method}", []).append((seconds, rel_mse(image), image.mean()))
            for variant, child in list(children.items()):
                path = folder / f"{variant}.npy"
                try:
                    child.stdin.write(f"{path}\n")
                    child.stdin.flush()
                    line = child.stdout.readline()
                except BrokenPipeError:
                    line = ""
                if not line:
                    print(f"Mitsuba's variant {variant} failed on this machine; see its messages above")
                    del children[variant]
                    continue
                image = np.load(path)
                seconds = json.loads(line)["seconds"]
                results.setdefault(f"Mitsuba {variant}", []).append((seconds, rel_mse(image), image.mean()))
        for child in children.values():
            child.stdin.close()
            child.wait()

    samples = args.size[0] * args.size[1] * args.spp
    print(f"{args.scene}: {args.size[0]}x{args.size[1]}, {args.spp} spp, depth {args.depth}, {args.threads} threads, "
          f"median of {args.runs} runs; mean of the references {np.mean(references):.5f}")
    print(f"{'':24}{'seconds':>9}{'Msamples/s':>12}{'relMSE':>11}{'efficiency':>12}{'mean':>10}")
    for name, rows in results.items():
        seconds, error, mean = (statistics.median(column) for column in zip(*rows))
        print(f"{name:24}{seconds:9.2f}{samples / seconds / 1e6:12.2f}{error:11.2e}{1 / (error * seconds):12.1f}{mean:10.5f}")


if __name__ == "__main__":
    main()
