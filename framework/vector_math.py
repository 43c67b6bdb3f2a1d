"""Elementary functions without branches or library calls, so that the loops over contacts vectorise.

Series are summed in pairs (Estrin's scheme): short chains of dependent operations keep the processor busy.
"""


def exp_bounded(x: float) -> float:
    """exp(x) for x in [-8, 0], to 1e-14 relative: the series of x/32 to the twelfth degree, squared five times."""
    y = x * 0.03125
    y2 = y * y
    y4 = y2 * y2
    low = (1 + y) + (1 / 2 + y * (1 / 6)) * y2
    middle = (1 / 24 + y * (1 / 120)) + (1 / 720 + y * (1 / 5040)) * y2
    high = (1 / 40320 + y * (1 / 362880)) + (1 / 3628800 + y * (1 / 39916800)) * y2
    power = low + y4 * (middle + y4 * (high + y4 * (1 / 479001600)))
    power = power * power
    power = power * power
    power = power * power
    power = power * power
    return power * power


def exp_unit(x: float) -> float:
    """exp(x) for x in [-1, 0], to 1e-14 relative: the series of x/8 to the ninth degree, squared three times."""
    y = x * 0.125
    y2 = y * y
    y4 = y2 * y2
    low = (1 + y) + (1 / 2 + y * (1 / 6)) * y2
    middle = (1 / 24 + y * (1 / 120)) + (1 / 720 + y * (1 / 5040)) * y2
    power = low + y4 * (middle + y4 * (1 / 40320 + y * (1 / 362880)))
    power = power * power
    power = power * power
    return power * power
