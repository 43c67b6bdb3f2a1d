"""Elementary functions without branches or library calls, so that the loops over contacts vectorise."""


def exp_bounded(x: float) -> float:
    """exp(x) for x in [-8, 0], to 1e-14 relative: the series of x/32 to the twelfth degree, squared five times."""
    y = x * 0.03125
    power = 1 + y * (1 + y * (1 / 2 + y * (1 / 6 + y * (1 / 24 + y * (1 / 120 + y * (1 / 720 + y * (
        1 / 5040 + y * (1 / 40320 + y * (1 / 362880 + y * (1 / 3628800 + y * (
            1 / 39916800 + y * (1 / 479001600))))))))))))  # fmt: skip
    power = power * power
    power = power * power
    power = power * power
    power = power * power
    return power * power
