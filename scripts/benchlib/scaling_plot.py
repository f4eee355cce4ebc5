#!/usr/bin/env python3
"""Draws scaling.json of scripts/bench-scaling: one log-log panel for each quantity.

Usage: scripts/benchlib/scaling_plot.py SCALING.json PICTURE.png

A script of its own, so that bench-scaling can call it with the interpreter that has matplotlib
(Debian: python3-matplotlib, for /usr/bin/python3).

Exit codes: 0 drawn, 2 usage, 3 there is no matplotlib.
"""
import json
import sys

try:
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.ticker import LogLocator, NullFormatter, NullLocator
except ImportError:
    sys.exit(3)

# The colours that estimators have in reports (harness/page/assets/base.js).
COLORS = {"mis": "#0072b2", "alsd": "#e69f00", "mdhi": "#009e73", "pmc_hi": "#d55e00",
          "bsdf": "#cc79a7", "light": "#56b4e9", "uniform": "#8a8a8a", "all": "#1b1f24"}
MARKERS = {"mis": "o", "alsd": "s", "mdhi": "^", "pmc_hi": "D", "bsdf": "P", "light": "v",
           "uniform": "X", "all": "o"}
OTHER_COLOR = "#7f5539"


def superscript(value: float, error: float | None) -> str:
    """An exponent, with its error where there is one, as mathematical text."""
    shown = f"{value:g}" if error is None else f"{value:.2f} \\pm {error:.2f}"
    return f"$x^{{{shown}}}$"


def draw_curve(axes: "pyplot.Axes", curve: dict) -> None:
    """Medians with the range of all rounds, and the fitted line under them."""
    name = curve["estimator"]
    color = COLORS.get(name, OTHER_COLOR)
    points = curve["points"]
    x = [p["x"] for p in points]
    y = [p["median"] for p in points]
    below = [p["median"] - p["min"] for p in points]
    above = [p["max"] - p["median"] for p in points]
    axes.plot(x, [curve["scale"] * v**curve["exponent"] for v in x], color=color, linewidth=0.8,
              linestyle="--", alpha=0.7)
    axes.errorbar(x, y, yerr=[below, above], color=color, marker=MARKERS.get(name, "o"),
                  markersize=4, linewidth=1.3, elinewidth=0.8, capsize=2,
                  label=f"{name}  {superscript(curve['exponent'], curve['error'])}")


def label_ticks(axis: "matplotlib.axis.Axis", low: float, high: float) -> None:
    """Decades; where there are less than two, also 2 and 5, as plain numbers."""
    narrow = high / low < 100
    axis.set_major_locator(LogLocator(base=10, subs=(1.0, 2.0, 5.0) if narrow else (1.0,)))
    axis.set_minor_locator(NullLocator())
    axis.set_minor_formatter(NullFormatter())
    if narrow:
        axis.set_major_formatter(lambda value, _: f"{value:g}")


def draw_panel(axes: "pyplot.Axes", panel: dict) -> None:
    """All curves of a panel and the slope that is expected."""
    axes.set_xscale("log")
    axes.set_yscale("log")
    for curve in panel["curves"]:
        draw_curve(axes, curve)
    x = [p["x"] for curve in panel["curves"] for p in curve["points"]]
    y = [v for curve in panel["curves"] for p in curve["points"] for v in (p["min"], p["max"])]
    low, high = min(y), max(y)
    if high / low < 10:  # a flat curve has to look flat
        middle = (low * high)**0.5
        low, high = middle / 10**0.5, middle * 10**0.5
    low, high = low / 1.25, high * 1.25
    # Room for the legend below the lowest curve, a share of the axis.
    legend = 0.02 + 0.066 * len(panel["curves"])
    low /= (high / low)**(legend / (1.0 - legend))
    axes.set_ylim(low, high)
    if len(set(x)) <= 7 and max(x) / min(x) < 200:
        axes.set_xticks(sorted(set(x)), [f"{v:g}" for v in sorted(set(x))])
        axes.xaxis.set_minor_locator(NullLocator())
    else:
        label_ticks(axes.xaxis, min(x), max(x))
    label_ticks(axes.yaxis, low, high)
    axes.set_xlabel(panel["x_label"])
    axes.set_ylabel(panel["y_label"])
    axes.set_title(f"expected {superscript(panel['expected'], None)}: {panel['why']}", fontsize=8)
    axes.grid(True, linewidth=0.4, color="#d0d7de")
    axes.legend(fontsize=7, frameon=False, handlelength=1.5, loc="lower left")


def main() -> int:
    """Reads, draws, writes."""
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    with open(sys.argv[1], encoding="utf-8") as stream:
        data = json.load(stream)
    panels = [p for p in data["panels"] if p["curves"]]
    columns = min(3, len(panels))
    rows = -(-len(panels) // columns)
    pyplot.rcParams.update({"font.family": "DejaVu Sans", "font.size": 8.5})
    figure, grid = pyplot.subplots(rows, columns, figsize=(4.0 * columns, 3.3 * rows + 0.5),
                                   squeeze=False, layout="constrained")
    for axes, panel in zip(grid.flat, panels):
        draw_panel(axes, panel)
    for axes in list(grid.flat)[len(panels):]:
        axes.set_visible(False)
    build = data["build"]
    facts = [f"{data['machine']['cpu']}, {data['machine']['cores']} cores",
             f"commit {build['commit']}, {build['preset']} build",
             f"medians and ranges of {data['repeat']} interleaved rounds",
             "dashed: fitted power"]
    figure.suptitle(("; " if columns > 1 else "\n").join(facts), fontsize=8)
    figure.savefig(sys.argv[2], dpi=130)
    return 0


if __name__ == "__main__":
    sys.exit(main())
