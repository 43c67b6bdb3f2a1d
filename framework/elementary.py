"""Elementary functions without branches or library calls, so that the loops over contacts vectorise."""


def exp_bounded(x: float) -> float:
    """exp(x) for x in [-4, 0], to 1e-14 relative: the series of x/8 to the tenth degree, squared three times."""
    y = x * 0.125
    series = 1 + y * (1 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * (1 / 720 + y * (
        1 / 5040 + y * (1 / 40320 + y * (1 / 362880 + y * (1 / 3628800))))))))))  # fmt: skip
    series = series * series
    series = series * series
    return series * series
