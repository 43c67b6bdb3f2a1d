"""Tessellation files, written by hand from the description of the format in Neper's manual.

Three grains in 2 x 1: a lower half, and an upper one in two parts that a slanted line divides.
"""

CELL = """***tess
 **format
   {format}
 **general
   {dimension} standard
 **cell
  3
  *id
   1 2 3
  *mode
   1 1 1
  *crysym
   cubic
{cell}"""

GEOMETRY = """ **vertex
 8
   1  0.000000000000 -0.000000000000 0.000000000000 0
   2  2.000000000000 0.000000000000 0.000000000000 0
   3  2.000000000000 0.500000000000 0.000000000000 0
   4  2.000000000000 1.000000000000 0.000000000000 0
   5  0.812345678901 1.000000000000 0.000000000000 0
   6  -0.000000000000 1.000000000000 0.000000000000 0
   7  0.000000000000 0.500000000000 0.000000000000 0
   8  1.123456789012 0.500000000000 {z} 0
 **edge
 10
   1 1 2 0
   2 2 3 0
   3 3 4 0
   4 4 5 0
   5 5 6 0
   6 6 7 0
   7 7 1 0
   8 7 8 0
   9 8 3 0
  10 8 5 0
 **face
 3
   1 5 7 8 3 2 1
     5 8 9 -2 -1 -7
     0.000000000000 0.000000000000 0.000000000000 -1.000000000000
     0 -1 0.000000000000 0.000000000000 0.000000000000
   2 4 7 8 5 6
     4 8 10 5 6
     0.000000000000 0.000000000000 0.000000000000 1.000000000000
     0 -1 0.000000000000 0.000000000000 0.000000000000
   3 4 8 3 4 5
     4 9 3 4 -10
     0.000000000000 0.000000000000 0.000000000000 1.000000000000
     0 -1 0.000000000000 0.000000000000 0.000000000000
 **domain
  *general
   {domain}
  *vertex
   4
   1 0.000000000000 0.000000000000 0.000000000000 x0y0
     1 1
   2 2.000000000000 0.000000000000 0.000000000000 x1y0
     1 2
   3 2.000000000000 1.000000000000 0.000000000000 x1y1
     1 4
   4 0.000000000000 1.000000000000 0.000000000000 x0y1
     1 6
  *edge
   4
   1 2 1 2 {type} {south}
     1 1
   2 2 2 3 {type} x1
     2 2 3
   3 2 3 4 {type} y1
     2 4 5
   4 2 4 1 {type} x0
     2 6 7
"""

PERIODIC = """ **periodicity
  *general
   1 0 0
   2.000000000000 0.000000000000 0.000000000000
  *seed
   0
  *vertex
   0
  *edge
   0
"""


def tess(format="3.5", *, dimension=2, cell="", z="0.000000000000", south="y0", more="", kind="line 0"):
    """The text of a file; format 2.0 says less of the domain's edges, and others need not say more."""
    domain, kind = ("square", "") if format == "2.0" else ("cube", kind)
    geometry = GEOMETRY.format(z=z, domain=domain, type=kind, south=south)
    return CELL.format(format=format, dimension=dimension, cell=cell) + geometry + more + "***end\n"


GROUPS = "  *group\n   2 1 2\n"
ORIENTED = (
    "  *seed\n   1 0.5 0.5 0.0 0.0\n   2 0.5 0.5 0.0 0.1\n   3 1.5 0.5 0.0 0.2\n"
    "  *ori\n   rodrigues:passive\n  0.1 0.2 0.3\n  0.1 0.2 0.3\n  0.1 0.2 0.3\n  *orispread\n   1\n 1\n 1\n"
)
SCALES = " **scale\n  *general\n   2\n  *cellid\n   1 1 1\n   2 2 1\n   3 2 2\n"
