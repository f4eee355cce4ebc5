"""What bench-scaling measures: the runs of each study, and what each panel reads from them."""
import dataclasses
import math
import os
import pathlib
import statistics
from collections.abc import Callable

from benchlib.programs import Render
from benchlib.scaling_scenes import write_hall, write_terrain

COMPARED = ("mis", "alsd", "mdhi", "pmc_hi")
# Their rays and work go where they choose; the others have a technique or chart for every light.
CHOOSING = ("alsd", "light", "bsdf", "uniform")
# Of one estimate in the study of lights, whatever the number of lights: the least that every
# estimator can spend on 10,000 of them.
LIGHT_BUDGET = 20_000


@dataclasses.dataclass(frozen=True)
class Study:
    """Runs over sizes. `call` makes one, in a folder for its scenes."""
    name: str
    sizes: tuple[int, ...]
    estimators: tuple[str, ...]
    call: Callable[[pathlib.Path, str, int], Render]


@dataclasses.dataclass(frozen=True)
class Target:
    """A limit for a number that is made of {size: y}."""
    text: str
    estimators: tuple[str, ...]
    value: Callable[[dict[float, float]], float]
    met: Callable[[float], bool]


@dataclasses.dataclass(frozen=True)
class Panel:
    """One quantity of a study over its size, with a unit each."""
    name: str
    study: str
    x_label: str
    y_label: str
    x: Callable[[dict], float]
    y: Callable[[dict], float]
    expected: float
    why: str
    target: Target | None = None
    merged: bool = False  # the quantity does not depend on the estimator
    expected_of: tuple[str, ...] | None = None  # None: of all estimators
    fit_from: float = 0.0  # x below that are left out of the fit where two others remain


def per_estimate_ns(row: dict) -> float:
    """CPU time of an estimate."""
    return row["time_cpu_s"] * 1e9 / row["estimates"]


def _image(pixels: int, aspect: float) -> tuple[int, int]:
    """Sides of about that many pixels, in whole tiles of 16 where the image is not tiny: the rest
    of a tile would make small images differ in more than their size."""
    step = 16 if pixels >= 5_000 else 1
    width = max(1, round(math.sqrt(pixels * aspect) / step)) * step
    return width, max(1, round(pixels / width / step)) * step


def thread_counts() -> tuple[int, ...]:
    """1, 2, 4, ... and all cores that this process may use."""
    cores = len(os.sched_getaffinity(0))
    counts = [1]
    while counts[-1] * 2 < cores:
        counts.append(counts[-1] * 2)
    return tuple(counts + [cores] if cores > 1 else counts)


def studies(scene: str, aspect: float, quick: bool, full: bool) -> list[Study]:
    """All studies. @param aspect  width / height of the scene's image"""
    def shipped(estimator: str, pixels: int, spp: int, srl: int, threads: int = 1) -> Render:
        return Render(scene, estimator, *_image(pixels, aspect), spp, str(srl), threads)

    def lights(folder: pathlib.Path, estimator: str, count: int) -> Render:
        file = folder / f"hall_{count}.json"
        if not file.exists():
            write_hall(folder, count)
        budget = 64 if quick else LIGHT_BUDGET
        # Two estimates for each pixel, because ALSD learns from the first ones.
        return Render(str(file), estimator, 8, 8, 2, str(budget // count))

    def triangles(folder: pathlib.Path, estimator: str, count: int) -> Render:
        file = folder / f"terrain_{count}.json"
        if not file.exists():
            write_terrain(folder, count)
        return Render(str(file), estimator, *((48, 32) if quick else (240, 160)), 2, "8")

    compared = ("mis", "pmc_hi") if quick else COMPARED
    pixels = 1_000 if quick else 14_400
    largest = (10_000_000,) if full else ()
    return [
        Study("threads", (1, 2) if quick else thread_counts(), compared,
              lambda _, e, n: shipped(e, 1_000 if quick else 130_000, 8, 8, n)),
        Study("pixels", (100, 400) if quick else (10_000, 30_000, 100_000, 300_000, 1_000_000),
              # Eight estimates: the first milliseconds fill the caches, and that is not growth.
              compared, lambda _, e, n: shipped(e, n, 8, 8)),
        Study("spp", (1, 2, 4) if quick else (1, 2, 4, 8, 16, 32, 64), compared,
              lambda _, e, n: shipped(e, pixels, n, 8)),
        Study("srl", (2, 4, 8) if quick else (2, 4, 8, 16, 32, 64, 128), compared,
              lambda _, e, n: shipped(e, pixels, 1, n)),
        Study("lights", (1, 4, 16) if quick else (1, 10, 100, 1_000, 10_000),
              compared + ("uniform",) if quick else
              ("mis", "alsd", "mdhi", "pmc_hi", "light", "bsdf", "uniform"), lights),
        Study("triangles", (200, 800) if quick else (1_000, 10_000, 100_000, 1_000_000) + largest,
              compared, triangles),
    ]


def _flatness(y: dict[float, float]) -> float:
    return max(y.values()) / min(y.values())


PANELS = [
    Panel("threads", "threads", "threads", "wall time [s]",
          lambda r: r["threads"], lambda r: r["time_wall_s"], -1.0, "the work is divided",
          Target("two threads >= 1.9 x one", COMPARED,
                 lambda y: y[1] / y[2] if {1, 2} <= y.keys() else math.nan,
                 lambda v: v >= 1.9)),
    Panel("work", "threads", "threads", "CPU time [s]",
          lambda r: r["threads"], lambda r: r["time_cpu_s"], 0.0, "none is done twice"),
    Panel("pixels", "pixels", "pixels", "CPU time per estimate [ns]",
          lambda r: r["width"] * r["height"], per_estimate_ns, 0.0, "estimates are independent",
          Target("slowest / fastest size <= 1.10", COMPARED, _flatness, lambda v: v <= 1.10)),
    Panel("spp", "spp", "estimates per pixel (SPP)", "CPU time [s]",
          lambda r: r["spp"], lambda r: r["time_cpu_s"], 1.0, "so many estimates"),
    Panel("srl", "srl", "shadow rays per light (SRL)", "CPU time per estimate [ns]",
          lambda r: r["srl"], per_estimate_ns, 1.0, "so many rays, and a fixed cost"),
    Panel("lights", "lights", "lights, at the same number of rays", "CPU time per ray [ns]",
          lambda r: r["lights"], lambda r: r["time_cpu_s"] * 1e9 / r["rays"], 0.0,
          "choosing does not visit every light",
          Target("10,000 lights <= 2 x 100", CHOOSING,
                 lambda y: y[10_000] / y[100] if {100, 10_000} <= y.keys() else math.nan,
                 lambda v: v <= 2.0), expected_of=CHOOSING),
    Panel("triangles", "triangles", "triangles", "CPU time per estimate [ns]",
          lambda r: r["triangles"], per_estimate_ns, 0.09,
          "log n, the depth of the tree"),  # d log(log n) / d log n = 1 / log n, at 1e5
    Panel("ray tracer", "triangles", "triangles", "building Embree's tree [ms]",
          lambda r: r["triangles"], lambda r: r["ray_tracer_build_ms"], 1.0, "n log n",
          merged=True, fit_from=9_000),  # threads have to start, whatever there is to do
    Panel("reading", "triangles", "triangles", "reading and building the scene [ms]",
          lambda r: r["triangles"], lambda r: r["read_ms"] + r["build_ms"], 1.0,
          "every byte is read once", merged=True, fit_from=9_000),
]


def rounds_of(panel: Panel, rows: list[dict], estimator: str) -> list[list[tuple[float, float]]]:
    """[round][size] (x, y). Merged panels take the median over the estimators of a round."""
    mine = [r for r in rows if r["study"] == panel.study
            and (panel.merged or r["estimator"] == estimator)]
    result = []
    for number in sorted({r["round"] for r in mine}):
        at: dict[float, list[float]] = {}
        for row in (r for r in mine if r["round"] == number):
            at.setdefault(panel.x(row), []).append(panel.y(row))
        result.append([(x, statistics.median(ys)) for x, ys in sorted(at.items())])
    return result


def judged(panel: Panel, rounds: list[list[tuple[float, float]]],
           estimator: str) -> tuple[float, float, float] | None:
    """The target's number for the medians over rounds, and the least and largest of single rounds;
    None where there is no target or the sizes that it compares were not measured."""
    if panel.target is None or estimator not in panel.target.estimators:
        return None
    medians = {x: statistics.median(r[i][1] for r in rounds) for i, (x, _) in enumerate(rounds[0])}
    value = panel.target.value(medians)
    if not math.isfinite(value):
        return None
    single = [panel.target.value(dict(r)) for r in rounds]
    return value, min(single), max(single)
