"""Vectors of the plane as complex numbers x + iy, for the reference step."""


def parts(z):
    return z.real, z.imag


def cross(a, b):
    return a.real * b.imag - a.imag * b.real


def dot(a, b):
    return a.real * b.real + a.imag * b.imag
