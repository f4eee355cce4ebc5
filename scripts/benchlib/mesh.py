"""A mesh of any size: a wavy height field over the unit square, the same on every run."""
import array
import math
import pathlib


def make_mesh(triangles: int) -> tuple[array.array, array.array]:
    """Coordinates of the vertices and corners of the triangles, flat. Their number is the nearest
    to `triangles` that a square grid can have; the surface does not depend on it."""
    side = max(1, round(math.sqrt(triangles / 2)))
    waves_x = [math.sin(37 * i / side) for i in range(side + 1)]
    vertices = array.array("f")
    for j in range(side + 1):
        z = j / side
        height = 0.05 * math.cos(29 * z)
        for i in range(side + 1):
            vertices.extend((i / side, height * waves_x[i], z))
    corners = array.array("i")
    for j in range(side):
        for i in range(side):
            a = j * (side + 1) + i
            b = a + side + 1
            corners.extend((a, b, a + 1, a + 1, b, b + 1))
    return vertices, corners


def write_ply(path: pathlib.Path, vertices: array.array, corners: array.array) -> None:
    """Binary, little-endian."""
    faces = bytearray()
    raw = corners.tobytes()
    for start in range(0, len(raw), 12):
        faces += b"\x03" + raw[start:start + 12]
    header = (f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices) // 3}\n"
              "property float x\nproperty float y\nproperty float z\n"
              f"element face {len(corners) // 3}\n"
              "property list uchar int vertex_indices\nend_header\n")
    with path.open("wb") as stream:
        stream.write(header.encode())
        stream.write(vertices.tobytes())
        stream.write(faces)
