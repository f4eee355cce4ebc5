"""Scenes whose number of lights or triangles is free, and in which nothing else changes with it."""
import json
import math
import pathlib

from benchlib.mesh import make_mesh, write_ply

EMITTING_AREA = 4.0  # of all lights of a hall together [m^2]
HALL_SIDE = 10.0
HALL_HEIGHT = 4.0


def _rectangle(name: str, origin: list[float], u: list[float], v: list[float],
               material: str) -> dict:
    """Of the scene format; its normal is u x v."""
    return {"name": name, "type": "rectangle", "origin": [round(c, 6) for c in origin],
            "edge_u": [round(c, 6) for c in u], "edge_v": [round(c, 6) for c in v],
            "material": material}


def _lights(count: int) -> list[dict]:
    """Square panels under the ceiling, facing down, spread by the R2 sequence (Roberts 2018), with
    radiances over a factor of four. Their common area is that of one."""
    plastic = 1.32471795724474602596  # root of x^3 = x + 1
    golden = (math.sqrt(5.0) - 1.0) / 2.0
    side = math.sqrt(EMITTING_AREA / count)
    room = HALL_SIDE - side
    shapes = []
    for i in range(count):
        x = (0.5 + i / plastic) % 1.0 * room - HALL_SIDE / 2
        z = (0.5 + i / plastic**2) % 1.0 * room - HALL_SIDE / 2
        light = _rectangle(f"light {i}", [x, HALL_HEIGHT - 0.05, z], [side, 0, 0], [0, 0, side],
                           "black")
        light["emission"] = {"radiance": round(4.0 * 2.0**(2.0 * (i * golden % 1.0) - 1.0), 4)}
        shapes.append(light)
    return shapes


def write_hall(folder: pathlib.Path, lights: int) -> pathlib.Path:
    """A hall with pillars whose lights all shine on every point of its floor: rays, area and power
    do not depend on the number of lights."""
    half, height = HALL_SIDE / 2, HALL_HEIGHT
    shapes = [_rectangle("floor", [-half, 0, half], [2 * half, 0, 0], [0, 0, -2 * half], "floor"),
              _rectangle("wall", [-half, 0, -half], [2 * half, 0, 0], [0, height, 0], "wall")]
    for i, (x, z) in enumerate([(-2.5, -2.5), (0.5, -3.0), (2.5, -1.5), (-1.5, 0.5)]):
        shapes.append({"name": f"pillar {i}", "type": "sphere", "center": [x, 1.0, z],
                       "radius": 0.8, "material": "glossy"})
    data = {"format": "penumbra-scene", "version": 1, "name": f"hall_{lights}",
            "camera": {"position": [0, 3.4, 4.8], "look_at": [0, 0.5, -1.5],
                       "vertical_fov_deg": 40, "resolution": [160, 90]},
            "materials": {"floor": {"type": "metallic_roughness", "base_color": [0.5, 0.48, 0.45],
                                    "metallic": 0, "roughness": 0.35},
                          "wall": {"type": "lambert", "reflectance": 0.6},
                          "glossy": {"type": "metallic_roughness", "base_color": [1, 0.8, 0.4],
                                     "metallic": 1, "roughness": 0.3},
                          "black": {"type": "lambert", "reflectance": 0}},
            "shapes": shapes + _lights(lights)}
    file = folder / f"hall_{lights}.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file


def write_terrain(folder: pathlib.Path, triangles: int) -> pathlib.Path:
    """A hilly surface under a small bright and a large dim light, cut into that many triangles."""
    mesh = folder / f"terrain_{triangles}.ply"
    write_ply(mesh, *make_mesh(triangles))
    small = _rectangle("small", [0.9, 0.5, 0.9], [0.05, 0, 0], [0, 0, 0.05], "black")
    small["emission"] = {"radiance": 60}
    large = _rectangle("large", [-0.4, 0.7, -0.4], [1, 0, 0], [0, 0, 1], "black")
    large["emission"] = {"radiance": 0.5}
    data = {"format": "penumbra-scene", "version": 1, "name": f"terrain_{triangles}",
            "camera": {"position": [0.5, 0.45, 1.25], "look_at": [0.5, 0.0, 0.5],
                       "vertical_fov_deg": 40, "resolution": [240, 160]},
            "include": [{"file": mesh.name}],
            "materials": {"black": {"type": "lambert", "reflectance": 0}},
            "shapes": [small, large]}
    file = folder / f"terrain_{triangles}.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return file
