"""Options that are lists with commas between."""

from __future__ import annotations

import math

import click


def seeds_of(text: str) -> list[int]:
    """The seeds of the option ``--seeds``. Raises click.BadParameter."""
    numbers = numbers_of("seeds", text)
    if not all(number.is_integer() for number in numbers):
        raise click.BadParameter(f"--seeds = {text} is not allowed, it must be whole numbers with commas between")
    return [int(number) for number in numbers]


def numbers_of(name: str, text: str) -> list[float]:
    """The numbers of a list with commas, each once. Raises click.BadParameter."""
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be numbers with commas between") from None
    if not all(map(math.isfinite, numbers)) or len(set(numbers)) < len(numbers):
        raise click.BadParameter(f"--{name} = {text} is not allowed, it must be finite numbers, each once")
    return numbers
