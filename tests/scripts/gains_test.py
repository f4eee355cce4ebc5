"""Tests of scripts/gains on result folders made by hand.

Usage: gains_test.py
"""
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent.parent / "scripts" / "gains"
CONFIG = {
    "baseline": "base", "tuned_baseline": "tuned", "scenes": [{"name": "room"}],
    "methods": [{"label": "base"}, {"label": "tuned"}, {"label": "new"},
                {"label": "new without", "tags": ["quick", "of new"]}, {"label": "rival", "tags": ["baseline"]}],
}


def row(label: str, block: int, relmse: float, time: float, **more: str) -> dict:
    """One run of 100 estimates with 1000 samples and 500 rays."""
    return {"scene": "room", "label": label, "block": str(block), "status": "ok", "sampler": "sobol", "params": "",
            "budget_s": "1", "contaminated": "", "relmse": str(relmse), "time_cpu_s": str(time), "samples": "1000",
            "rays": "500", "estimates": "100", **more}


class Gains(unittest.TestCase):
    """The script as a user calls it."""

    def setUp(self) -> None:
        self.scratch = tempfile.TemporaryDirectory()
        self.addCleanup(self.scratch.cleanup)
        self.folder = pathlib.Path(self.scratch.name)

    def run_on(self, rows: list) -> subprocess.CompletedProcess:
        """Writes a folder and compares its methods."""
        (self.folder / "config.resolved.json").write_text(json.dumps(CONFIG))
        with open(self.folder / "measurements.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys())
            writer.writeheader()
            writer.writerows(rows)
        return subprocess.run([sys.executable, str(SCRIPT), str(self.folder)], capture_output=True, text=True,
                              check=False)

    def gains(self) -> dict:
        """By method and the other."""
        with open(self.folder / "gains.csv", newline="", encoding="utf-8") as file:
            return {(r["method"], r["over"]): r for r in csv.DictReader(file)}

    def test_gains_are_quotients_of_error_times_cost(self) -> None:
        """A quarter of the error in half the time; the variant has the error twice over."""
        rows = []
        for block in (0, 1):
            rows += [row("base", block, 0.4, 2.0), row("tuned", block, 0.2, 2.0), row("new", block, 0.1, 1.0),
                     row("new without", block, 0.2, 1.0), row("rival", block, 0.1, 1.5)]
        self.assertEqual(self.run_on(rows).returncode, 0)
        found = self.gains()
        self.assertAlmostEqual(float(found["new", "base"]["gain_samples"]), 4.0)
        self.assertAlmostEqual(float(found["new", "base"]["gain_time"]), 8.0)
        self.assertAlmostEqual(float(found["new", "tuned"]["gain_time"]), 4.0)
        self.assertAlmostEqual(float(found["new", "new without"]["gain_rays"]), 2.0)
        self.assertEqual(found["new", "new without"]["kind"], "mechanism")
        self.assertNotIn(("new without", "base"), found)
        self.assertAlmostEqual(float(found["new", "rival"]["gain_time"]), 1.5)
        self.assertAlmostEqual(float(found["rival", "tuned"]["gain_samples"]), 2.0)
        self.assertNotIn(("new without", "rival"), found)
        self.assertAlmostEqual(float(found["new", "base"]["rays_per_estimate"]), 5.0)

    def test_interval_is_the_jackknife_of_the_textbook(self) -> None:
        """Errors 1 and 3 of the method, 1 and 1 of the other: leaving one out gives log 1/3 and log 1."""
        rows = [row("base", 0, 1.0, 1.0), row("base", 1, 1.0, 1.0), row("new", 0, 1.0, 1.0), row("new", 1, 3.0, 1.0)]
        self.run_on(rows)
        found = self.gains()["new", "base"]
        error = math.sqrt(0.5 * 2 * (0.5 * math.log(3)) ** 2)
        self.assertAlmostEqual(float(found["gain_samples"]), 0.5)
        self.assertAlmostEqual(math.log(float(found["gain_samples_hi"])), math.log(0.5) + 12.706 * error, 9)

    def test_the_first_undisturbed_attempt_counts(self) -> None:
        """The disturbed one before it took longer."""
        rows = [row("base", 0, 1.0, 1.0), row("new", 0, 1.0, 9.0, contaminated="load"), row("new", 0, 1.0, 1.0)]
        self.run_on(rows)
        self.assertAlmostEqual(float(self.gains()["new", "base"]["gain_time"]), 1.0)

    def test_several_budgets_are_refused(self) -> None:
        """Their blocks have the same numbers."""
        rows = [row("base", 0, 1.0, 1.0), row("new", 0, 1.0, 1.0), row("new", 1, 1.0, 1.0, budget_s="2")]
        result = self.run_on(rows)
        self.assertEqual(result.returncode, 2)
        self.assertIn("several point sets, parameters or budgets", result.stderr)

    def test_a_folder_without_a_result_is_refused(self) -> None:
        """It says which file is missing."""
        result = subprocess.run([sys.executable, str(SCRIPT), str(self.folder)], capture_output=True, text=True,
                                check=False)
        self.assertEqual(result.returncode, 2)
        self.assertIn("config.resolved.json", result.stderr)


if __name__ == "__main__":
    unittest.main()
