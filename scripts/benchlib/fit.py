"""Growth exponents: straight lines through logarithms."""
import dataclasses
import math
import statistics


@dataclasses.dataclass(frozen=True)
class Growth:
    """y = scale x^exponent. The error is not a number where nothing tells it: two sizes measured
    once."""
    exponent: float
    error: float
    scale: float

    def at(self, x: float) -> float:
        """The fitted y."""
        return self.scale * x**self.exponent


def _line(xs: list[float], ys: list[float]) -> tuple[float, float, float]:
    """Least squares: slope, value at 0, standard error of the slope by the residuals (not a number
    with two points)."""
    mean_x, mean_y = statistics.fmean(xs), statistics.fmean(ys)
    spread = sum((x - mean_x)**2 for x in xs)
    slope = sum((x - mean_x) * (y - mean_y) for x, y in zip(xs, ys)) / spread
    start = mean_y - slope * mean_x
    if len(xs) < 3:
        return slope, start, math.nan
    residuals = sum((y - start - slope * x)**2 for x, y in zip(xs, ys))
    return slope, start, math.sqrt(residuals / (len(xs) - 2) / spread)


def growth(rounds: list[list[tuple[float, float]]]) -> Growth:
    """Fit through the medians of all rounds.

    Its standard error is the larger of two: by the residuals, which also shows where no power
    describes the growth, and by the scatter of the slopes of single rounds, which shows the noise.
    @param rounds  [round][size] (x, y), all positive; every round has the same sizes, two at least
    """
    xs = [math.log(x) for x, _ in rounds[0]]
    if len(set(xs)) < 2:
        raise ValueError("an exponent needs two sizes")
    medians = [math.log(statistics.median(r[i][1] for r in rounds)) for i in range(len(xs))]
    slope, start, by_residuals = _line(xs, medians)
    slopes = [_line(xs, [math.log(y) for _, y in r])[0] for r in rounds]
    by_scatter = math.nan
    if len(slopes) > 1:
        by_scatter = statistics.stdev(slopes) / math.sqrt(len(slopes))
    known = [e for e in (by_residuals, by_scatter) if math.isfinite(e)]
    return Growth(slope, max(known, default=math.nan), math.exp(start))
