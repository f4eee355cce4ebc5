"""Tests of scripts/bench, scripts/bench-scaling and scripts/bench-presets: their arithmetic, and their quick forms
on a build. Times are never judged: tests run on busy machines.

Usage: bench_scripts_test.py BUILD_DIR
"""
import csv
import importlib.machinery
import importlib.util
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
SCRIPTS = pathlib.Path(__file__).resolve().parent.parent.parent / "scripts"
sys.path.insert(0, str(SCRIPTS))
from benchlib import fit, mesh, programs, scaling_studies  # noqa: E402

BUILD_DIR = ""


def module_of(script: str):
    """A script without a suffix as a module."""
    loader = importlib.machinery.SourceFileLoader(script.replace("-", "_"), str(SCRIPTS / script))
    spec = importlib.util.spec_from_loader(loader.name, loader)
    assert spec is not None
    module = importlib.util.module_from_spec(spec)
    loader.exec_module(module)
    return module


def call(script: str, *arguments: str) -> subprocess.CompletedProcess:
    """A call as a user makes it."""
    return subprocess.run([sys.executable, str(SCRIPTS / script), *arguments], capture_output=True,
                          text=True, check=False)


class Growth(unittest.TestCase):
    """The fit of exponents."""

    def test_power_law_is_found_exactly(self) -> None:
        """Every round has its own factor, which changes no slope."""
        rounds = [[(x, c * x**1.5) for x in (1.0, 10.0, 100.0)] for c in (2.0, 3.0, 4.0)]
        found = fit.growth(rounds)
        self.assertAlmostEqual(found.exponent, 1.5, 12)
        self.assertAlmostEqual(found.scale, 3.0, 12)
        self.assertAlmostEqual(found.error, 0.0, 12)

    def test_error_is_that_of_the_textbook(self) -> None:
        """log y = 0, 1, 0 over log x = -1, 0, 1: slope 0, residual sum 2/3, Sxx 2."""
        rounds = [[(math.exp(-1), 1.0), (1.0, math.e), (math.e, 1.0)]]
        found = fit.growth(rounds)
        self.assertAlmostEqual(found.exponent, 0.0, 12)
        self.assertAlmostEqual(found.error, math.sqrt(2 / 3 / 1 / 2), 12)

    def test_scatter_of_rounds_counts_where_the_medians_fit(self) -> None:
        """Slopes 0 and 2 by two sizes: mean 1, standard error 1."""
        found = fit.growth([[(1.0, 1.0), (10.0, 1.0)], [(1.0, 1.0), (10.0, 100.0)]])
        self.assertAlmostEqual(found.error, 1.0, 12)

    def test_two_sizes_once_have_no_error(self) -> None:
        """Nothing tells it."""
        found = fit.growth([[(1.0, 1.0), (10.0, 10.0)]])
        self.assertAlmostEqual(found.exponent, 1.0, 12)
        self.assertTrue(math.isnan(found.error))

    def test_one_size_is_refused(self) -> None:
        """A slope needs two."""
        with self.assertRaises(ValueError):
            fit.growth([[(2.0, 1.0)]])


class Targets(unittest.TestCase):
    """Verdicts on made-up rows, on both sides of each limit."""

    @staticmethod
    def judged(name: str, ys: dict[float, float], estimator: str = "alsd"):
        """The verdict of one round."""
        panel = next(p for p in scaling_studies.PANELS if p.name == name)
        found = scaling_studies.judged(panel, [sorted(ys.items())], estimator)
        return None if found is None else (found[0], panel.target.met(found[0]))

    def test_threads(self) -> None:
        """Speed-up of two."""
        self.assertEqual(self.judged("threads", {1: 3.8, 2: 2.0}), (1.9, True))
        self.assertFalse(self.judged("threads", {1: 3.7, 2: 2.0})[1])
        self.assertIsNone(self.judged("threads", {1: 3.7}))

    def test_pixels(self) -> None:
        """Largest ratio of any two sizes."""
        self.assertTrue(self.judged("pixels", {1e4: 100.0, 1e5: 105.0, 1e6: 109.0})[1])
        self.assertFalse(self.judged("pixels", {1e4: 100.0, 1e5: 111.0, 1e6: 101.0})[1])

    def test_lights(self) -> None:
        """Only estimators that choose."""
        ys = {1: 1.0, 100: 10.0, 10_000: 21.0}
        self.assertFalse(self.judged("lights", ys)[1])
        self.assertTrue(self.judged("lights", {**ys, 10_000: 19.0})[1])
        self.assertIsNone(self.judged("lights", ys, "pmc_hi"))


class Presets(unittest.TestCase):
    """The comparison of presets on made-up rows."""

    def test_other_bits_and_ratios_are_seen(self) -> None:
        """The second preset takes twice and half the time; once it has another picture."""
        compare = module_of("bench-presets").compare
        rows = [{"scene": "s", "estimator": "e", "preset": preset, "round": number,
                 "time_cpu_s": time, "image_hash": bits}
                for preset, number, time, bits in (("a", 0, 1.0, "x"), ("b", 0, 2.0, "x"),
                                                   ("a", 1, 4.0, "x"), ("b", 1, 2.0, "y"))]
        base, other = compare(rows)
        self.assertTrue(base["same_bits"])
        self.assertFalse(other["same_bits"])
        self.assertEqual((other["ratio_min"], other["ratio"], other["ratio_max"]), (0.5, 1.25, 2.0))

    def test_same_program_twice_has_the_same_bits(self) -> None:
        """Two rounds of every estimator of the program."""
        with tempfile.TemporaryDirectory() as folder:
            done = call("bench-presets", "--quick", "--out", folder, "--program", f"a={BUILD_DIR}",
                        "--program", f"b={BUILD_DIR}")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            with (pathlib.Path(folder) / "measurements.csv").open(encoding="utf-8") as stream:
                rows = list(csv.DictReader(stream))
            data = json.loads((pathlib.Path(folder) / "presets.json").read_text(encoding="utf-8"))
        names = [e["name"] for e in programs.estimators(pathlib.Path(BUILD_DIR) / "bin/penumbra")]
        self.assertEqual(len(rows), 2 * 2 * len(names))
        self.assertEqual({r["estimator"] for r in rows}, set(names))
        self.assertTrue(all(float(r["time_cpu_s"]) > 0 for r in rows))
        self.assertEqual(set(data["builds"]), {"a", "b"})
        self.assertIn("flags", data["builds"]["a"])

    def test_usage(self) -> None:
        """Faults of the caller end with 2."""
        self.assertEqual(call("bench-presets", "--program", "a=/nowhere", "--program",
                              "b=/nowhere").returncode, 2)
        self.assertEqual(call("bench-presets", "--program", "nowhere").returncode, 2)


class Bench(unittest.TestCase):
    """The targets on made-up costs, and the quick form on the build."""

    @staticmethod
    def cost(estimator: str, rays: float, total: float, adapt: float, limit: float) -> dict:
        """What `penumbra inspect` would say of Buddha."""
        return {"scene": "buddha", "estimator": estimator, "rays": rays, "total_ns": total,
                "stages_ns": {"adapt": adapt}, "share_of_limit": limit / total}

    def verdicts(self, mis: dict, pmc_hi: dict) -> list[str]:
        """Limit of mis, limit, adaptation and time per ray of pmc_hi."""
        bench = module_of("bench")
        targets = bench.Targets()
        bench.judge_costs([mis, pmc_hi], ("buddha",), targets)
        return [row["verdict"] for row in targets.rows]

    def test_targets_are_judged_on_both_sides_of_their_limits(self) -> None:
        """Each number just on one side, then on the other."""
        self.assertEqual(self.verdicts(self.cost("mis", 10, 1000, 0, 600),
                                       self.cost("pmc_hi", 10, 1100, 55, 550)), ["met"] * 4)
        self.assertEqual(self.verdicts(self.cost("mis", 10, 1000, 0, 599),
                                       self.cost("pmc_hi", 10, 1101, 56, 550)), ["missed"] * 4)

    def test_times_of_a_plan_are_read(self) -> None:
        """As `penumbra plan` prints them."""
        seconds = module_of("bench").seconds
        self.assertAlmostEqual(seconds("references   1 h 2 min 3 s"), 3723.0)
        self.assertAlmostEqual(seconds("references   2.5 s"), 2.5)
        with self.assertRaises(programs.RunFailed):
            seconds("references")

    def test_quick_form_writes_table_and_measurements(self) -> None:
        """Every target of one scene has a row, and every cost its stages and bare times."""
        with tempfile.TemporaryDirectory() as folder:
            done = call("bench", "--quick", "--only", "costs", "--build-dir", BUILD_DIR, "--out",
                        folder)
            self.assertIn(done.returncode, (0, 1), done.stdout + done.stderr)
            with (pathlib.Path(folder) / "targets.csv").open(encoding="utf-8") as stream:
                rows = list(csv.DictReader(stream))
            data = json.loads((pathlib.Path(folder) / "bench.json").read_text(encoding="utf-8"))
        self.assertEqual([row["verdict"] in ("met", "missed") for row in rows], [True] * 4)
        self.assertEqual([c["estimator"] for c in data["costs"]], ["mis", "pmc_hi"])
        for cost in data["costs"]:
            self.assertEqual(set(cost["stages_ns"]),
                             {"outside", "set_up", "sample", "trace", "weigh", "adapt"})
            self.assertGreater(min(cost["bare_ns"].values()), 0.0)
            self.assertGreater(cost["bare_fast_flags_ns"], 0.0)


class Scaling(unittest.TestCase):
    """The quick form on the build."""

    def test_quick_form_writes_all_rows_and_finite_exponents(self) -> None:
        """Every study, size and estimator twice."""
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "out"
            done = call("bench-scaling", "--quick", "--build-dir", BUILD_DIR, "--out", str(out))
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            with (out / "measurements.csv").open(encoding="utf-8") as stream:
                rows = list(csv.DictReader(stream))
            data = json.loads((out / "scaling.json").read_text(encoding="utf-8"))
            drawn = (out / "scaling.png").exists()
        self.assertEqual(tuple(rows[0]), module_of("bench-scaling").COLUMNS)
        expected = sum(2 * len(s.sizes) * len(s.estimators)
                       for s in scaling_studies.studies("checkerboard", 1.5, True, False))
        self.assertEqual(len(rows), expected)
        self.assertEqual([p["name"] for p in data["panels"]],
                         [p.name for p in scaling_studies.PANELS])
        for panel in data["panels"]:
            for curve in panel["curves"]:
                self.assertTrue(math.isfinite(curve["exponent"]), (panel["name"], curve))
                self.assertTrue(math.isfinite(curve["error"]), (panel["name"], curve))
                self.assertIsNone(curve["target"], "tiny sizes are not judged")
                self.assertIn(f"{panel['name']:11}{curve['estimator']:10}", done.stdout)
        self.assertTrue(drawn or "python3-matplotlib" in done.stderr, done.stderr)

    def test_work_does_not_depend_on_what_should_not_change_it(self) -> None:
        """Threads change no bit, and the halls spend the same rays on any number of lights."""
        with tempfile.TemporaryDirectory() as folder:
            done = call("bench-scaling", "--quick", "--build-dir", BUILD_DIR, "--out", folder,
                        "--only", "threads", "--only", "lights", "--repeat", "1")
            self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
            with (pathlib.Path(folder) / "measurements.csv").open(encoding="utf-8") as stream:
                rows = list(csv.DictReader(stream))
        self.assertEqual({r["study"] for r in rows}, {"threads", "lights"})
        for estimator in ("mis", "pmc_hi"):
            hashes = {r["image_hash"] for r in rows
                      if r["study"] == "threads" and r["estimator"] == estimator}
            self.assertEqual(len(hashes), 1, estimator)
        samples = [int(r["samples"]) / int(r["estimates"]) for r in rows
                   if r["study"] == "lights" and r["estimator"] == "mis"]
        # 64, but where pillars turn away from some of the lights.
        self.assertLessEqual(max(samples), 64.0)
        self.assertGreaterEqual(min(samples), 0.9 * 64.0)

    def test_usage(self) -> None:
        """Faults of the caller end with 2."""
        self.assertEqual(call("bench-scaling", "--only", "everything").returncode, 2)
        self.assertEqual(call("bench-scaling", "--build-dir", "/nowhere").returncode, 2)
        self.assertEqual(call("bench-scaling", "--quick", "--repeat", "0").returncode, 2)

    def test_mesh_has_the_number_of_triangles_that_a_grid_can_have(self) -> None:
        """2 x 22^2 is nearest to 1,000."""
        vertices, corners = mesh.make_mesh(1_000)
        self.assertEqual(len(corners), 3 * 2 * 22**2)
        self.assertEqual(len(vertices), 3 * 23**2)
        self.assertEqual(max(corners), 23**2 - 1)


if __name__ == "__main__":
    BUILD_DIR = sys.argv.pop()
    unittest.main(verbosity=2)
