#!/usr/bin/env python3
"""Writes the scenes of this folder: `python3 scenes/make.py`. Their files are committed; this is how they were made.

`python3 scenes/make.py large FOLDER [TRIANGLES]` writes a scene of that many triangles (560,000) to measure with.
"""
import math
import pathlib
import sys

HERE = pathlib.Path(__file__).parent


class Obj:
    def __init__(self, name, purpose):
        self.name, self.purpose = name, purpose
        self.lines, self.v, self.vn, self.material = [], 0, 0, None

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
else:
    for scene in (cornell, glossy, mirrors, ajar, caustic, corner, furnace):
        scene()
