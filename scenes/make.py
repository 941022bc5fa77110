#!/usr/bin/env python3
"""Writes the scenes of this folder: `python3 scenes/make.py`. Their files are committed; this is how they were made.

`python3 scenes/make.py large FOLDER [TRIANGLES]` writes a scene of that many triangles (560,000) to measure with;
`python3 scenes/make.py lamps FOLDER` one with 10,000 emitting triangles.
"""
import math
import pathlib
import random
import struct
import sys
import zlib

HERE = pathlib.Path(__file__).parent


class Obj:
    def __init__(self, name, purpose):
        self.name, self.purpose = name, purpose
        self.lines, self.v, self.vn, self.vt, self.material = [], 0, 0, 0, None

    def use(self, material):
        if material != self.material:
            self.lines.append(f"usemtl {material}")
            self.material = material

    def polygon(self, material, *corners):
        """Corners counter-clockwise seen from the front."""
        self.use(material)
        for c in corners:
            self.lines.append("v " + " ".join(f"{x:.6g}" for x in c))
        self.lines.append("f " + " ".join(str(self.v + i + 1) for i in range(len(corners))))
        self.v += len(corners)

    def mapped(self, material, corners, texcoords):
        """A polygon with texture coordinates."""
        self.use(material)
        self.lines += ["v " + " ".join(f"{x:.6g}" for x in c) for c in corners]
        self.lines += ["vt " + " ".join(f"{x:.6g}" for x in t) for t in texcoords]
        self.lines.append("f " + " ".join(f"{self.v + i + 1}/{self.vt + i + 1}" for i in range(len(corners))))
        self.v += len(corners)
        self.vt += len(corners)

    def globe(self, material, centre, radius, rows=16):
        """A sphere with vertex normals, and texture coordinates by longitude and latitude."""
        self.use(material)
        columns = 2 * rows
        for i in range(rows + 1):
            for j in range(columns + 1):
                theta, phi = math.pi * i / rows, 2 * math.pi * j / columns
                n = (math.sin(theta) * math.sin(phi), math.cos(theta), math.sin(theta) * math.cos(phi))
                self.lines.append("v " + " ".join(f"{centre[k] + radius * n[k]:.6g}" for k in range(3)))
                self.lines.append("vn " + " ".join(f"{x:.5g}" for x in n))
                self.lines.append(f"vt {j / columns:.6g} {1 - i / rows:.6g}")
        for i in range(rows):
            for j in range(columns):
                a, b = i * (columns + 1) + j, (i + 1) * (columns + 1) + j
                # Around the poles one side has no length.
                corners = [b, b + 1, a + 1] if i == 0 else [b, a + 1, a] if i == rows - 1 else [b, b + 1, a + 1, a]
                self.lines.append("f " + " ".join(
                    f"{self.v + c + 1}/{self.vt + c + 1}/{self.vn + c + 1}" for c in corners))
        count = (rows + 1) * (columns + 1)
        self.v, self.vn, self.vt = self.v + count, self.vn + count, self.vt + count

    def rectangle(self, material, a, b, c):
        """A parallelogram with corner b between a and c."""
        d = tuple(a[i] + c[i] - b[i] for i in range(3))
        self.polygon(material, a, b, c, d)

    def block(self, material, centre, size, turn=0.0):
        """An upright block that stands on centre's height, turned by `turn` degrees, normals outside."""
        cos, sin = math.cos(math.radians(turn)), math.sin(math.radians(turn))
        (cx, cy, cz), (sx, sy, sz) = centre, size

        def p(i, j, k):
            x, z = (i - 0.5) * sx, (k - 0.5) * sz
            return (cx + cos * x + sin * z, cy + j * sy, cz - sin * x + cos * z)

        for face in (
            ((0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)),
            ((1, 0, 0), (0, 0, 0), (0, 1, 0), (1, 1, 0)),
            ((1, 0, 1), (1, 0, 0), (1, 1, 0), (1, 1, 1)),
            ((0, 0, 0), (0, 0, 1), (0, 1, 1), (0, 1, 0)),
            ((0, 1, 1), (1, 1, 1), (1, 1, 0), (0, 1, 0)),
            ((0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)),
        ):
            self.polygon(material, *(p(*c) for c in face))

    def sphere(self, material, centre, radius, level=3, smooth=True):
        """An icosphere with vertex normals, its corners on the sphere."""
        g = (1 + math.sqrt(5)) / 2
        corners = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
                   (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
        unit = lambda p: tuple(x / math.sqrt(sum(y * y for y in p)) for x in p)
        corners = [unit(p) for p in corners]
        faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
                 (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
                 (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]
        for _ in range(level):
            middle, finer = {}, []

            def mid(a, b):
                key = (min(a, b), max(a, b))
                if key not in middle:
                    corners.append(unit([corners[a][i] + corners[b][i] for i in range(3)]))
                    middle[key] = len(corners) - 1
                return middle[key]

            for a, b, c in faces:
                ab, bc, ca = mid(a, b), mid(b, c), mid(c, a)
                finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
            faces = finer
        self.use(material)
        for p in corners:
            self.lines.append("v " + " ".join(f"{centre[i] + radius * p[i]:.6g}" for i in range(3)))
        if smooth:
            for p in corners:
                self.lines.append("vn " + " ".join(f"{x:.5g}" for x in p))
        for f in faces:
            if smooth:
                self.lines.append("f " + " ".join(f"{self.v + i + 1}//{self.vn + i + 1}" for i in f))
            else:
                self.lines.append("f " + " ".join(str(self.v + i + 1) for i in f))
        self.v += len(corners)
        self.vn += len(corners) if smooth else 0

    def room(self, left="red", right="green", wall="white"):
        """x and z from -1 to 1, y from 0 to 2, open at z = 1, seen from the inside."""
        self.rectangle(wall, (-1, 0, 1), (1, 0, 1), (1, 0, -1))
        self.rectangle(wall, (-1, 2, -1), (1, 2, -1), (1, 2, 1))
        self.rectangle(wall, (-1, 0, -1), (1, 0, -1), (1, 2, -1))
        self.rectangle(left, (-1, 0, 1), (-1, 0, -1), (-1, 2, -1))
        self.rectangle(right, (1, 0, -1), (1, 0, 1), (1, 2, 1))

    def lamp(self, material="light", x=0.0, z=0.0, half=0.25, y=1.99):
        """A square lamp that shines downwards."""
        self.rectangle(material, (x - half, y, z - half), (x + half, y, z - half), (x + half, y, z + half))

    def write(self, materials, camera, size=(256, 256), environment=None, folder=HERE):
        comment = "".join(f"# {line}\n" for line in self.purpose.strip().splitlines())
        mtl = "".join(f"newmtl {name}\n" + "".join(f"{key} {value}\n" for key, value in m.items()) + "\n"
                      for name, m in materials.items())
        origin, target, fov = camera
        toml = (comment + f"[camera]\norigin = {list(origin)}\ntarget = {list(target)}\nup = [0, 1, 0]\nfov = {fov}\n\n"
                f"[film]\nwidth = {size[0]}\nheight = {size[1]}\n")
        if environment is not None:
            toml += f"\n[environment]\nradiance = {list(environment)}\n"
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.obj").write_text(
            comment + f"mtllib {self.name}.mtl\n" + "\n".join(self.lines) + "\n")
        (folder / f"{self.name}.mtl").write_text(f"# Materials of {self.name}.obj\n" + mtl)
        (folder / f"{self.name}.toml").write_text(toml)


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


def write_png(path, width, height, pixel):
    """8-bit pictures: `pixel(x, y)` has 1, 3 or 4 bytes."""
    channels = len(pixel(0, 0))
    rows = b"".join(b"\0" + bytes(v for x in range(width) for v in pixel(x, y)) for y in range(height))

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows, 9))
                     + chunk(b"IEND", b""))


def write_hdr(path, width, height, pixel):
    """Radiance pictures, not compressed."""
    def rgbe(colour):
        most = max(colour)
        if most < 1e-32:
            return bytes(4)
        mantissa, exponent = math.frexp(most)
        return bytes([*(int(c * mantissa * 256 / most) for c in colour), exponent + 128])

    header = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    path.write_bytes(header + b"".join(rgbe(pixel(x, y)) for y in range(height) for x in range(width)))


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
    for scene in (cornell, glossy, mirrors, ajar, caustic, corner, furnace, still):
        scene()
