"""Calls of `penumbra render --json` and what they say."""
import dataclasses
import json
import os
import pathlib
import shlex
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent


class RunFailed(Exception):
    """A call of the program failed; the text says which and why."""


def program_of(preset: str, folder: str | None = None) -> pathlib.Path:
    """The program of a preset, or of a build folder. Raises FileNotFoundError with the command that
    makes it."""
    place = pathlib.Path(folder) if folder else ROOT / "build" / preset
    program = place / "bin" / "penumbra"
    if not os.access(program, os.X_OK):
        raise FileNotFoundError(f"{program} is not built: scripts/setup --build {preset}")
    return program


@dataclasses.dataclass(frozen=True)
class Render:
    """One picture: a scene's name or file, and what `penumbra render` takes."""
    scene: str
    estimator: str
    width: int
    height: int
    spp: int
    srl: str
    threads: int = 1
    seed: int = 1

    def arguments(self) -> list[str]:
        """Those of the program, without the output."""
        return ["render", self.scene, "--estimator", self.estimator, "--spp", str(self.spp),
                "--srl", self.srl, "--threads", str(self.threads), "--seed", str(self.seed),
                "--resolution", str(self.width), str(self.height)]


def render(program: pathlib.Path, call: Render) -> dict:
    """What the program prints, with "peak_mb" and "load_average" of the call."""
    with tempfile.TemporaryDirectory(prefix="penumbra-bench-") as folder:
        command = [str(program), *call.arguments(), "--json", "-o", f"{folder}/picture.png"]
        load_average = os.getloadavg()[0]
        errors = pathlib.Path(folder) / "errors.txt"
        with errors.open("w", encoding="utf-8") as stream:
            with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=stream,
                                  text=True) as process:
                assert process.stdout is not None
                output = process.stdout.read()
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
        if process.returncode != 0:
            raise RunFailed(f"{' '.join(command)} ended with {process.returncode}:\n"
                            f"{errors.read_text(encoding='utf-8', errors='replace')}")
    result = json.loads(output)
    result["peak_mb"] = usage.ru_maxrss / 1024
    result["load_average"] = load_average
    return result


def estimators(program: pathlib.Path) -> list[dict]:
    """The program's estimators, in its order."""
    done = subprocess.run([str(program), "list", "estimators", "--json"], capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        raise RunFailed(f"{program} list estimators failed: {done.stderr}")
    found = json.loads(done.stdout)
    return found["estimators"] if isinstance(found, dict) else found


def command_line() -> str:
    """The call of this script in the project's folder, without that of its results, which may move."""
    words = [str(pathlib.Path(sys.argv[0]).resolve().relative_to(ROOT)), *sys.argv[1:]]
    if "--out" in words:
        at = words.index("--out")
        del words[at:at + 2]
    return shlex.join(words)


def machine() -> dict:
    """What the numbers were measured on."""
    model = "unknown"
    for line in pathlib.Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
        if line.startswith("model name"):
            model = line.split(":", 1)[1].strip()
            break
    return {"cpu": model, "cores": len(os.sched_getaffinity(0)),
            "kernel": f"{os.uname().sysname} {os.uname().release}",
            "memory_gb": round(memory_gb("MemTotal"), 1)}


def memory_gb(what: str = "MemAvailable") -> float:
    """A line of /proc/meminfo."""
    for line in pathlib.Path("/proc/meminfo").read_text(encoding="utf-8").splitlines():
        if line.startswith(what + ":"):
            return int(line.split()[1]) / 2**20
    return 0.0
