"""What `make.py` builds scenes of: shapes, written as OBJ, MTL and TOML, and pictures for textures."""
import math
import pathlib
import struct
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

    def surface(self, material, point, columns, rows, smooth=None):
        """A grid of quads over `point(u, v)` for u and v from 0 to 1, front where v goes up to the left of u, with
        texture coordinates. A point is a position, with a colour behind it if it has six numbers. Normals are
        left to the reader, by a smoothing group, if one is given."""
        self.use(material)
        if smooth is not None:
            self.lines.append(f"s {smooth}")
        for i in range(rows + 1):
            for j in range(columns + 1):
                self.lines.append("v " + " ".join(f"{x:.5g}" for x in point(j / columns, i / rows)))
                self.lines.append(f"vt {j / columns:.5g} {i / rows:.5g}")
        for i in range(rows):
            for j in range(columns):
                a = i * (columns + 1) + j + 1
                corners = (a, a + 1, a + columns + 2, a + columns + 1)
                self.lines.append("f " + " ".join(f"{self.v + c}/{self.vt + c}" for c in corners))
        count = (rows + 1) * (columns + 1)
        self.v, self.vt = self.v + count, self.vt + count
        if smooth is not None:
            self.lines.append("s off")

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

    def write(self, materials, camera=None, size=(256, 256), environment=None, folder=HERE):
        """OBJ and MTL, and a TOML if there is a camera."""
        comment = "".join(f"# {line}\n" for line in self.purpose.strip().splitlines())
        mtl = "".join(f"newmtl {name}\n" + "".join(f"{key} {value}\n" for key, value in m.items()) + "\n"
                      for name, m in materials.items())
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.obj").write_text(
            comment + f"mtllib {self.name}.mtl\n" + "\n".join(self.lines) + "\n")
        (folder / f"{self.name}.mtl").write_text(f"# Materials of {self.name}.obj\n" + mtl)
        if camera is None:
            return
        origin, target, fov = camera
        toml = (comment + f"[camera]\norigin = {list(origin)}\ntarget = {list(target)}\nup = [0, 1, 0]\nfov = {fov}\n\n"
                f"[film]\nwidth = {size[0]}\nheight = {size[1]}\n")
        if environment is not None:
            toml += f"\n[environment]\nradiance = {list(environment)}\n"
        (folder / f"{self.name}.toml").write_text(toml)


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
