"""Tests of scripts/gate-merge-base in a small repository whose builds and programs are stand-ins that write down how
they were called. What the gate itself finds is tested elsewhere; here: what is compared, and which code comes out.

Usage: gate_merge_base_test.py
"""
import os
import pathlib
import shutil
import subprocess
import tempfile
import unittest

SCRIPT = pathlib.Path(__file__).resolve().parent.parent.parent / "scripts" / "gate-merge-base"

# Builds the "program" of its own checkout.
SETUP = r"""#!/bin/bash
cd "$(dirname "${BASH_SOURCE[0]}")/.."
[[ ! -e broken ]] || exit 1
mkdir -p build/release/bin
cp program build/release/bin/penumbra
"""

# Writes its arguments down, one a line, and ends as it is told.
PROGRAM = r"""#!/bin/bash
{ echo "$PWD"; printf '%s\n' "$@"; } >"$LOGS/gate.log"
((${GATE_CODE:-0} == 2)) || { mkdir -p gate && echo "## verdict" >gate/gate.md; }
exit "${GATE_CODE:-0}"
"""


class GateMergeBase(unittest.TestCase):
    """A repository with main, and a branch "work" one commit ahead, which is checked out."""

    def setUp(self) -> None:
        """Makes it."""
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.logs = pathlib.Path(folder.name) / "logs"
        self.logs.mkdir()
        self.repo = pathlib.Path(folder.name) / "repo"
        (self.repo / "scripts").mkdir(parents=True)
        shutil.copy(SCRIPT, self.repo / "scripts")
        self.write("scripts/setup", SETUP)
        self.write("program", PROGRAM)
        self.write(".gitignore", "/build/\n/gate/\n")
        self.git("init", "-q", "-b", "main")
        self.base = self.commit("First\n\nPerf-Ack: old/cell/sobol -9% before the base")
        self.git("checkout", "-q", "-b", "work")
        self.head = self.commit("Second")

    def write(self, name: str, text: str) -> None:
        """An executable file of the repository."""
        path = self.repo / name
        path.write_text(text, encoding="utf-8")
        path.chmod(0o755)

    def git(self, *arguments: str) -> str:
        """What git prints."""
        names = ["-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "commit.gpgsign=false"]
        return subprocess.run(["git", *names, *arguments], cwd=self.repo, check=True, capture_output=True,
                              text=True).stdout.strip()

    def commit(self, message: str) -> str:
        """Commits everything, even nothing."""
        self.git("add", "-A")
        self.git("commit", "-q", "--allow-empty", "-m", message)
        return self.git("rev-parse", "HEAD")

    def call(self, *arguments: str, **environment: str) -> subprocess.CompletedProcess:
        """A call from another folder."""
        known = {key: value for key, value in os.environ.items()
                 if not key.startswith(("GIT_", "GITHUB_", "PENUMBRA_"))}
        return subprocess.run([str(self.repo / "scripts" / "gate-merge-base"), *arguments], cwd=self.logs, check=False,
                              capture_output=True, text=True, env={**known, "LOGS": str(self.logs), **environment})

    def gate_arguments(self) -> list[str]:
        """How the gate was called."""
        folder, *arguments = (self.logs / "gate.log").read_text(encoding="utf-8").splitlines()
        self.assertEqual(pathlib.Path(folder), self.repo.resolve())
        return arguments

    def base_checkout(self) -> str:
        """The commit that was built as the base."""
        return self.git("-C", "build/gate-base", "rev-parse", "HEAD")

    def test_compares_the_programs_of_both_commits(self) -> None:
        """From the head's checkout."""
        done = self.call()
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual(self.base_checkout(), self.base)
        self.assertEqual(self.gate_arguments(),
                         ["gate", "--base-exe", "build/gate-base/build/release/bin/penumbra", "--head-exe",
                          "build/release/bin/penumbra", "--config", "configs/gate.json", "--out", "gate/gate.json"])

    def test_base_is_where_the_branch_began_not_where_main_is(self) -> None:
        """Main has gone on since."""
        self.git("checkout", "-q", "main")
        self.commit("Third, of somebody else")
        self.git("checkout", "-q", "work")
        self.assertEqual(self.call("main").returncode, 0)
        self.assertEqual(self.base_checkout(), self.base)

    def test_the_checkout_of_the_base_follows_a_later_base(self) -> None:
        """Also where the folder was removed behind git's back."""
        self.assertEqual(self.call().returncode, 0)
        later = self.commit("Third")
        self.commit("Fourth")
        self.assertEqual(self.call(later).returncode, 0)
        self.assertEqual(self.base_checkout(), later)
        shutil.rmtree(self.repo / "build")
        self.assertEqual(self.call().returncode, 0)
        self.assertEqual(self.base_checkout(), self.base)

    def test_trailers_since_the_base_are_passed_on(self) -> None:
        """One word each, a folded one on one line; earlier ones and the text of a message are none."""
        self.commit("Trade\n\nPerf-Ack: in/the text\n\nmore\n\nPerf-Ack: scene/PMC-HI 2m/sobol -4% less memory,\n"
                    "  which $(matters) more\nPerf-Ack: scene/*/sobol -2% \"other\"")
        self.assertEqual(self.call().returncode, 0)
        given = self.gate_arguments()
        self.assertEqual(given[given.index("gate/gate.json") + 1:],
                         ["--ack", "scene/PMC-HI 2m/sobol -4% less memory, which $(matters) more",
                          "--ack", "scene/*/sobol -2% \"other\""])

    def test_options_and_further_arguments_are_passed_on(self) -> None:
        """Behind everything else."""
        self.assertEqual(self.call("--config", "a b.json", "--out", "gate/x.json", "main", "--", "--threads", "2"
                                   ).returncode, 0)
        self.assertEqual(self.gate_arguments()[5:], ["--config", "a b.json", "--out", "gate/x.json", "--threads", "2"])

    def test_every_exit_code_of_the_gate_comes_out(self) -> None:
        """Whatever it is."""
        for code in (0, 1, 2, 3, 4, 5, 6, 130):
            self.assertEqual(self.call(GATE_CODE=str(code)).returncode, code)

    def test_neutral_turns_only_the_inconclusive_one_into_a_warning(self) -> None:
        """GitHub reads the warning from the output."""
        done = self.call("--neutral", GATE_CODE="3")
        self.assertEqual(done.returncode, 0)
        self.assertIn("\n::warning title=Gate::", "\n" + done.stdout)
        for code in (1, 4, 6):
            done = self.call("--neutral", GATE_CODE=str(code))
            self.assertEqual(done.returncode, code)
            self.assertNotIn("::warning", done.stdout)

    def test_summary_of_a_workflow_gets_the_result(self) -> None:
        """Behind what it holds, also of a failure."""
        summary = self.logs / "summary.md"
        summary.write_text("before\n", encoding="utf-8")
        self.assertEqual(self.call(GATE_CODE="1", GITHUB_STEP_SUMMARY=str(summary)).returncode, 1)
        self.assertEqual(summary.read_text(encoding="utf-8"), "before\n## verdict\n")
        # The stand-in writes none then.
        self.assertEqual(self.call(GATE_CODE="2", GITHUB_STEP_SUMMARY=str(summary)).returncode, 2)
        self.assertEqual(summary.read_text(encoding="utf-8"), "before\n## verdict\n")

    def test_failing_builds_are_failures_of_runs(self) -> None:
        """Of the head; then the gate is not called."""
        self.write("broken", "")
        self.assertEqual(self.call().returncode, 4)
        self.assertFalse((self.logs / "gate.log").exists())

    def test_a_base_that_is_not_there_is_a_missing_baseline(self) -> None:
        """So is one without a common commit."""
        self.assertEqual(self.call("no-such-branch").returncode, 5)
        self.git("checkout", "-q", "--orphan", "other")
        self.commit("Other root")
        self.git("checkout", "-q", "work")
        self.assertEqual(self.call("other").returncode, 5)

    def test_wrong_arguments_are_usage_errors(self) -> None:
        """With the word that is wrong."""
        for arguments in (["--nuetral"], ["--out"], ["main", "work"]):
            done = self.call(*arguments)
            self.assertEqual(done.returncode, 2, done.stderr)
            self.assertIn(arguments[-1], done.stderr)


if __name__ == "__main__":
    unittest.main()
