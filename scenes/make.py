#!/usr/bin/env python3
"""Writes the scenes of this folder: `python3 scenes/make.py`. Their files are committed; this is how they were made.

`python3 scenes/make.py large FOLDER [TRIANGLES]` writes a scene of that many triangles (560,000) to measure with;
`python3 scenes/make.py lamps FOLDER` one with 10,000 emitting triangles.
"""
import math
import pathlib
import random
import sys

from shapes import HERE, Obj, write_hdr, write_png

DIFFUSE = {
    "white": {"Kd": "0.73 0.73 0.73"},
    "red": {"Kd": "0.63 0.06 0.05"},
    "green": {"Kd": "0.12 0.45 0.10"},
}
LIGHT = {"light": {"Kd": "0 0 0", "Ke": "16 13 9"}}
FRONT = ((0.0, 1.0, 4.2), (0.0, 1.0, 0.0), 35.0)


def cornell():
    o = Obj("cornell", "A diffuse box with two blocks and one lamp: the plain case, in which reconnection does all the work.")
    o.room()
    o.block("white", (0.35, 0.0, 0.3), (0.6, 0.6, 0.6), 17)
    o.block("white", (-0.35, 0.0, -0.3), (0.6, 1.2, 0.6), -18)
    o.lamp()
    o.write(DIFFUSE | LIGHT, FRONT)


def glossy():
    o = Obj("glossy", "A block of rough metal and a ball of smooth glass in a diffuse box: reconnection at rough metal,\nhalf-vector copies through the glass.")
    o.room()
    o.block("metal", (-0.38, 0.0, -0.25), (0.6, 1.15, 0.6), -20)
    o.sphere("glass", (0.42, 0.4, 0.3), 0.38)
    o.lamp()
    metal = {"metal": {"Kd": "0 0 0", "Ks": "0.9 0.75 0.5", "Pm": "1", "Pr": "0.4"}}
    glass = {"glass": {"Kd": "0 0 0", "Ni": "1.5", "illum": "7"}}
    o.write(DIFFUSE | LIGHT | metal | glass, FRONT)


def mirrors():
    o = Obj("mirrors", "A left wall and a block that are perfect mirrors, and a ball of nearly smooth metal: chains of half-vector\ncopies, and offset paths that meet other surfaces than their base path.")
    o.room(left="mirror")
    o.block("mirror", (-0.4, 0.0, -0.2), (0.55, 1.0, 0.55), 25)
    o.sphere("satin", (0.4, 0.38, 0.25), 0.38)
    o.block("white", (0.1, 0.0, 0.75), (0.25, 0.25, 0.25), 40)
    o.lamp()
    mirror = {"mirror": {"Kd": "0 0 0", "Ks": "0.9 0.9 0.9", "illum": "3", "Ns": "1000"}}
    satin = {"satin": {"Kd": "0 0 0", "Ks": "0.95 0.8 0.6", "Pm": "1", "Pr": "0.15"}}
    o.write(DIFFUSE | LIGHT | mirror | satin, FRONT)


def ajar():
    o = Obj("ajar", "A room that is lit only through a gap beside a door: all light takes two bounces or more, and light samples\nare nearly always blocked.")
    o.room()
    # The lamp stands to the left of the wall at x = -0.7, which ends before the back wall.
    o.block("white", (-0.7, 0.0, 0.08), (0.04, 2.0, 1.84))
    o.block("white", (0.35, 0.0, -0.3), (0.45, 0.9, 0.45), 20)
    o.block("blue", (0.1, 0.0, 0.35), (0.3, 0.3, 0.3), -30)
    # A screen hides the lamp's side from the camera.
    o.rectangle("white", (-1, 0, 1), (-1, 2, 1), (-0.7, 2, 1))
    o.lamp(x=-0.86, z=0.0, half=0.12)
    o.write(DIFFUSE | {"blue": {"Kd": "0.15 0.2 0.6"}, "light": {"Kd": "0 0 0", "Ke": "360 330 300"}}, FRONT)


def caustic():
    o = Obj("caustic", "A ball of glass over a small lamp on the floor, and no other light: what the ball focuses on the ceiling is found\nby BSDF sampling alone, and noisily. There are no light samples through glass.")
    o.room()
    o.sphere("glass", (0.0, 0.62, 0.0), 0.4)
    h = 0.12
    o.rectangle("light", (-h, 0.01, h), (h, 0.01, h), (h, 0.01, -h))
    o.block("white", (0.65, 0.0, -0.4), (0.4, 0.8, 0.4), 30)
    glass = {"glass": {"Kd": "0 0 0", "Ni": "1.5", "illum": "7"}}
    o.write(DIFFUSE | {"light": {"Kd": "0 0 0", "Ke": "60 55 45"}} | glass, FRONT)


def pane():
    o = Obj("pane", """A closed room with two windows: a slab of glass to the right, before a lamp in the open, and a single sheet of
glass in the ceiling, under a clear sky. All light comes in through glass.""")
    for wall in ("floor", "back", "front"):
        a, b, c = {
            "floor": ((-1, 0, 1), (1, 0, 1), (1, 0, -1)),
            "back": ((-1, 0, -1), (1, 0, -1), (1, 2, -1)),
            "front": ((1, 0, 1), (-1, 0, 1), (-1, 2, 1)),
        }[wall]
        o.rectangle("white", a, b, c)
    o.rectangle("red", (-1, 0, 1), (-1, 0, -1), (-1, 2, -1))
    # Walls with openings: the right one from z = -0.6 to 0.3 and y = 0.6 to 1.6, the ceiling from x = -0.6 to 0.1.
    x, (z0, z1), (y0, y1) = 1, (-0.6, 0.3), (0.6, 1.6)
    o.rectangle("white", (x, 0, -1), (x, 0, 1), (x, y0, 1))
    o.rectangle("white", (x, y1, -1), (x, y1, 1), (x, 2, 1))
    o.rectangle("white", (x, y0, -1), (x, y0, z0), (x, y1, z0))
    o.rectangle("white", (x, y0, z1), (x, y0, 1), (x, y1, 1))
    (a, b), (c, d) = (-0.6, 0.1), (-0.5, 0.2)
    o.rectangle("white", (-1, 2, -1), (a, 2, -1), (a, 2, 1))
    o.rectangle("white", (b, 2, -1), (1, 2, -1), (1, 2, 1))
    o.rectangle("white", (a, 2, -1), (b, 2, -1), (b, 2, c))
    o.rectangle("white", (a, 2, d), (b, 2, d), (b, 2, 1))
    o.block("glass", (1.04, y0, 0.5 * (z0 + z1)), (0.05, y1 - y0, z1 - z0))
    o.rectangle("glass", (a, 2.01, c), (b, 2.01, c), (b, 2.01, d))
    o.rectangle("light", (2.4, 1.9, 0.4), (2.4, 1.9, -0.2), (2.7, 1.4, -0.2))
    o.block("white", (0.35, 0.0, -0.45), (0.4, 0.6, 0.4), 20)
    o.sphere("green", (-0.4, 0.3, -0.2), 0.3)
    glass = {"glass": {"Kd": "0 0 0", "Ni": "1.5", "illum": "7"}}
    light = {"light": {"Kd": "0 0 0", "Ke": "60 50 35"}}
    o.write(DIFFUSE | light | glass, ((-0.5, 1.1, 0.95), (0.3, 0.85, -1.0), 70.0))
    with (HERE / "pane.toml").open("a") as toml:
        toml.write("\n[environment]\nmodel = \"sky\"\nsun = [70.0, 60.0]\nscale = 0.3\n")


def rings():
    o = Obj("rings", "Curved mirrors: a metal ring whose inside throws the light of a small lamp back onto the floor as a heart, a\nmirror ball, and a bowl that gathers light on the wall.")
    o.room()
    ring = lambda u, v: (0.45 * math.sin(2 * math.pi * u) - 0.35, 0.02 + 0.22 * v, 0.45 * math.cos(2 * math.pi * u) + 0.3)
    o.surface("metal", ring, 96, 4, smooth=1)
    o.sphere("metal", (0.5, 0.3, -0.35), 0.3)
    bowl = lambda u, v: (0.62 + 0.3 * math.sin(0.9 * v) * math.cos(2 * math.pi * u), 0.65 - 0.35 * math.cos(0.9 * v) + 0.35,
                         0.5 + 0.3 * math.sin(0.9 * v) * math.sin(2 * math.pi * u))
    o.surface("metal", bowl, 64, 12, smooth=1)
    o.lamp(x=-0.75, z=0.3, half=0.06, y=1.4)
    metal = {"metal": {"Kd": "0 0 0", "Ks": "0.95 0.85 0.6", "Pm": "1", "Pr": "0"}}
    o.write(DIFFUSE | {"light": {"Kd": "0 0 0", "Ke": "160 140 110"}} | metal, FRONT)


def corner():
    o = Obj("corner", "Contacts and creases: blocks against the walls and on one another, a leaning board and a narrow slot. Short\nreconnections blow up the Jacobian; the weights must hold them.")
    o.room()
    o.block("white", (-0.75, 0.0, -0.75), (0.5, 0.7, 0.5))
    o.block("red", (-0.75, 0.7, -0.75), (0.3, 0.3, 0.3), 45)
    o.block("green", (0.3, 0.0, -0.8), (0.5, 0.9, 0.4))
    o.block("white", (0.826, 0.0, -0.8), (0.5, 0.6, 0.4))
    # A board that leans against the right wall, and a wedge with a sharp crease on the floor.
    o.rectangle("white", (0.4, 0.001, 0.6), (0.4, 0.001, 0.1), (0.999, 0.9, 0.1))
    o.polygon("white", (-0.6, 0.0, 0.6), (0.0, 0.0, 0.6), (0.0, 0.08, 0.2), (-0.6, 0.08, 0.2))
    o.lamp()
    o.write(DIFFUSE | LIGHT, FRONT)


def furnace():
    o = Obj("furnace", """Balls that absorb nothing in an environment of radiance 1: white Lambert, a conductor with F0 = 1 and roughness 0,
smooth glass. Exact answer: 1 in every pixel. Each ball is convex and far from the others only in effect: whatever a
path meets multiplies it by 1 on average, and every path that ends reaches radiance 1; so the picture falls short of 1
by exactly the share of the paths longer than --depth, which shrinks geometrically.""")
    o.sphere("white", (-1.2, 0.0, 0.0), 0.5, level=2)
    o.sphere("mirror", (0.0, 0.0, 0.0), 0.5, level=2)
    o.sphere("glass", (1.2, 0.0, 0.0), 0.5, level=2)
    materials = {
        "white": {"Kd": "1 1 1"},
        "mirror": {"Kd": "0 0 0", "Ks": "1 1 1", "Pm": "1", "Pr": "0"},
        "glass": {"Kd": "0 0 0", "Ni": "1.5", "illum": "7"},
    }
    o.write(materials, ((0.0, 0.0, 6.0), (0.0, 0.0, 0.0), 24.0), (192, 96), (1, 1, 1))


def still():
    o = Obj("still", """Textures, plastic and sky: a tiled floor, a leaf cut out of a rectangle, a board with bumps, balls of plastic under
rough and smooth coats, of a half metallic paint and of metal whose roughness varies, lit by a map of the sky.""")
    square = ((0, 0), (1, 0), (1, 1), (0, 1))
    o.mapped("tiles", ((-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3)), [(3 * u, 3 * v) for u, v in square])
    o.mapped("leaf", ((-1.1, 0.1, 0.7), (-0.1, 0.1, 0.7), (-0.1, 1.1, 0.5), (-1.1, 1.1, 0.5)), square)
    o.mapped("bumpy", ((0.3, 0.05, 0.2), (1.7, 0.05, 0.0), (1.7, 1.4, -0.4), (0.3, 1.4, -0.2)), square)
    o.globe("plastic", (-1.9, 0.6, -0.6), 0.6)
    o.globe("lacquer", (-0.5, 0.6, -1.2), 0.6)
    o.globe("paint", (0.9, 0.6, -1.6), 0.6)
    o.globe("brushed", (2.4, 0.5, -0.5), 0.5)
    materials = {
        "tiles": {"map_Kd": "still-tiles.png"},
        "leaf": {"map_Kd": "still-leaf.png", "map_d": "still-leaf.png"},
        "bumpy": {"Kd": "0.7 0.7 0.7", "map_Bump": "-bm 1.28 still-bumps.png"},
        "plastic": {"Kd": "0.1 0.3 0.7", "Ks": "0.5 0.5 0.5", "Ns": "100", "Ni": "1.5", "illum": "2"},
        "lacquer": {"Kd": "0.6 0.05 0.05", "Pr": "0", "Ni": "1.5"},
        "paint": {"Kd": "0.8 0.5 0.2", "Pr": "0.4", "Pm": "0.5"},
        "brushed": {"Ks": "0.9 0.85 0.8", "Pm": "1", "map_Pr": "still-bumps.png"},
    }
    o.write(materials, ((0.0, 1.9, 5.0), (0.1, 0.5, 0.0), 36.0), (384, 256))
    with (HERE / "still.toml").open("a") as toml:
        toml.write("""
[cameras.close]
origin = [-1.0, 1.0, 2.5]
target = [-0.7, 0.6, 0.0]
aperture = 0.1

[environment]
map = "still-sky.hdr"
rotation = 20.0
""")

    def tile(x, y):
        if x < 10 and y < 10:
            return (30, 60, 200)
        return ((205, 70, 45), (235, 225, 205))[(x // 16 + y // 16) % 2]

    def leaf(x, y):
        u, v = (x - 63.5) / 63.5, (y - 63.5) / 63.5
        inside = abs(u) < 0.75 * (1 - v * v) and abs(v) < 0.95
        return (90 + int(50 * abs(u)), 150 if abs(u) > 0.04 else 190, 60, 255 if inside else 0)

    write_png(HERE / "still-tiles.png", 64, 64, tile)
    write_png(HERE / "still-leaf.png", 128, 128, leaf)
    write_png(HERE / "still-bumps.png", 64, 64, lambda x, y: (int(
        127.5 + 120 * math.sin(2 * math.pi * x / 16) * math.sin(2 * math.pi * y / 16)),))

    def sky(x, y):
        up = max(0.0, 1 - y / 32)
        if 12 <= y < 15 and 36 <= x < 39:
            return (220, 190, 150)
        return (0.25 + 0.15 * up, 0.3 + 0.25 * up, 0.35 + 0.5 * up) if y < 32 else (0.15, 0.13, 0.1)

    write_hdr(HERE / "still-sky.hdr", 128, 64, sky)


def porch():
    o = Obj("porch", """What people download has no lamp and no camera: flagstones under a normal map, a window with an open sheet of
glass, leaves that the alpha of their picture cuts out, a stone that has its colours at the vertices.""")
    o.mapped("flagstones", ((-1.3, 0, 0.9), (1.3, 0, 0.9), (1.3, 0, -0.9), (-1.3, 0, -0.9)),
             ((0, 0), (2.6, 0), (2.6, 1.8), (0, 1.8)))
    o.block("wood", (0, -0.12, 0), (2.7, 0.115, 1.9))
    # A window that stands in its frame.
    x, z, width, height, beam = 0.55, 0.35, 1.1, 1.25, 0.07
    for side in (-0.5, 0.5):
        o.block("wood", (x + side * (width - beam), 0, z), (beam, height, 0.1))
    for y in (0, 0.5 * (height - beam), height - beam):
        o.block("wood", (x, y, z), (width - 2 * beam, beam, 0.08))
    w = 0.5 * width - beam
    o.rectangle("pane", (x - w, 0, z), (x + w, 0, z), (x + w, height, z))

    # A pot: its profile turned about the vertical axis.
    profile = ((0.0, 0.0), (0.17, 0.0), (0.25, 0.36), (0.28, 0.36), (0.28, 0.44), (0.23, 0.44), (0.22, 0.38), (0.0, 0.38))

    def pot(u, v):
        at = min(int(v * 7), 6)
        (r0, y0), (r1, y1) = profile[at:at + 2]
        t = v * 7 - at
        r, angle = r0 + (r1 - r0) * t, 2 * math.pi * u
        return (-0.62 + r * math.sin(angle), y0 + (y1 - y0) * t, 0.1 + r * math.cos(angle))

    o.surface("terracotta", pot, 48, 7)
    for i in range(14):
        turn, reach, top = 2.4 * i, 0.25 + 0.022 * (i % 5), 0.35 + 0.035 * (14 - i)

        def leaf(u, v):
            """From the pot upwards and outwards, drooping at its tip."""
            r, y = reach * v * 1.6, 0.38 + top * math.sin(2.2 * v)
            side = (u - 0.5) * 0.24
            return (-0.62 + r * math.cos(turn) - side * math.sin(turn), y - 0.6 * side * side,
                    0.1 + r * math.sin(turn) + side * math.cos(turn))

        o.surface("leaves", leaf, 4, 12, smooth=1)

    def stone(u, v):
        theta, phi = math.pi * (1 - v), 2 * math.pi * u
        n = (math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi))
        bump = sum(math.sin(k * n[0] * 3 + k) * math.sin(k * n[1] * 2) * math.cos(k * n[2] * 3 + 1) / k for k in (1, 2, 3, 5))
        r = 0.42 * (1 + 0.18 * bump)
        moss = min(max(2.2 * n[1] + 1.5 * bump, 0), 1)
        colour = [a + (b - a) * moss for a, b in zip((0.62, 0.58, 0.54), (0.36, 0.5, 0.16))]
        return (0.55 + r * n[0], 0.34 + 0.85 * r * n[1], -0.35 + r * n[2], *colour)

    o.surface("stone", stone, 64, 32, smooth=2)
    o.write({
        "flagstones": {"Kd": "0.62 0.6 0.57", "map_Bump": "-bm 1.0 porch-flagstones.png"},
        "wood": {"Kd": "0.5 0.3 0.16", "Ks": "0.3 0.3 0.3", "Ns": "60", "illum": "2"},
        "pane": {"Kd": "0.8 0.9 0.9", "Ks": "0.5 0.5 0.5", "Ni": "1.5", "d": "0.1", "illum": "4"},
        "terracotta": {"Kd": "0.62 0.27 0.16"},
        "leaves": {"map_Kd": "porch-leaf.png"},
        "stone": {"Kd": "1 1 1"},
    })

    def flagstones(x, y):
        """Two courses of stones with round edges, as directions."""
        def height(x, y):
            row = int(y // 64) % 2
            u, v = (x + 32 * row) % 64, y % 64
            edge = min(u, 64 - u, v, 64 - v)
            return 6 * min(edge / 6, 1) ** 0.5 + 0.7 * math.sin(x * 0.39) * math.sin(y * 0.49)

        slope = (height(x + 1, y) - height(x - 1, y)) / 2, (height(x, y - 1) - height(x, y + 1)) / 2
        n = (-slope[0], -slope[1], 1)
        length = math.sqrt(sum(c * c for c in n))
        return tuple(round(127.5 + 127.5 * c / length) for c in n)

    def leaf(x, y):
        u, v = (x - 63.5) / 63.5, (y - 63.5) / 63.5
        inside = abs(u) < 0.7 * (1 - v * v) and abs(v) < 0.97
        vein = abs(u) < 0.05 or abs(abs(u) - 0.8 * ((v + 3) % 0.25)) < 0.02
        return (*((150, 180, 90) if vein else (70, 125, 45)), 255 if inside else 0)

    write_png(HERE / "porch-flagstones.png", 128, 128, flagstones)
    write_png(HERE / "porch-leaf.png", 128, 128, leaf)


def lamps(folder):
    """A hall of 60 x 60 m with blocks and 5,000 small square lamps of different power under its ceiling."""
    o = Obj("lamps", "A hall with 10,000 emitting triangles, to measure how lights are chosen.")
    draw = random.Random(1)
    o.rectangle("white", (-30, 0, 30), (30, 0, 30), (30, 0, -30))
    o.rectangle("white", (-30, 4, -30), (30, 4, -30), (30, 4, 30))
    for i in range(40):
        o.block(("white", "red", "green")[i % 3], (draw.uniform(-28, 28), 0, draw.uniform(-28, 28)),
                (draw.uniform(1, 4), draw.uniform(0.5, 3.5), draw.uniform(1, 4)), draw.uniform(0, 90))
    for i in range(5000):
        x, z, y = draw.uniform(-29, 29), draw.uniform(-29, 29), draw.uniform(2.5, 3.9)
        o.lamp(("warm", "cold", "dim")[i % 3], x, z, 0.04, y)
    lights = {"warm": {"Kd": "0 0 0", "Ke": "60 40 20"}, "cold": {"Kd": "0 0 0", "Ke": "20 40 60"},
              "dim": {"Kd": "0 0 0", "Ke": "4 4 4"}}
    o.write(DIFFUSE | lights, ((-28.0, 1.7, 20.0), (0.0, 1.2, 0.0), 60.0), (384, 216), folder=pathlib.Path(folder))


def large(folder, triangles):
    """A box with rows of diffuse, metal and glass balls, finely triangulated."""
    o = Obj("large", f"A box with balls of {triangles} triangles in all, to measure with.")
    o.room()
    # Each level of subdivision has four times the triangles; the number of balls makes up the rest.
    level = max(0, round(math.log(triangles / 108 / 20, 4)))
    count = max(1, min(144, round(triangles / (20 * 4 ** level))))
    for i in range(count):
        x, y, z = i % 6, i // 36, i // 6 % 6
        centre = (-0.83 + 0.33 * x + 0.02 * (y % 2), 0.16 + 0.5 * y, -0.83 + 0.33 * z)
        o.sphere(("white", "red", "metal", "green", "white", "glass")[(x + 2 * y + z) % 6], centre, 0.13, level)
    o.lamp()
    metal = {"metal": {"Kd": "0 0 0", "Ks": "0.9 0.75 0.5", "Pm": "1", "Pr": "0.4"}}
    glass = {"glass": {"Kd": "0 0 0", "Ni": "1.5", "illum": "7"}}
    o.write(DIFFUSE | LIGHT | metal | glass, FRONT, folder=pathlib.Path(folder))


if sys.argv[1:2] == ["large"]:
    large(sys.argv[2], int(sys.argv[3]) if len(sys.argv) > 3 else 560_000)
elif sys.argv[1:2] == ["lamps"]:
    lamps(sys.argv[2])
else:
    for scene in (cornell, glossy, mirrors, pane, rings, ajar, caustic, corner, furnace, still, porch):
        scene()
