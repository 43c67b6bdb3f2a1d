"""What ``help`` says of parameters: each has a meaning, read from the comment beside its declaration or above it."""

import attrs
from support import offenders

import grainlaw as gl
from grainlaw.arguments import Checked
from grainlaw.declared import DYNAMIC, file_of

PACKAGES = (gl, *(getattr(gl, name) for name in gl.MODULES))
DECLARED = sorted(
    {
        each
        for package in PACKAGES
        for name in package.__all__
        if isinstance(each := getattr(package, name), Checked)
        if attrs.has(each) and any(field.init for field in attrs.fields(each))
    },
    key=lambda each: each.__name__,
)


def meanings(kind):
    """The last column of the table at the end of a docstring, by the name of the parameter."""
    lines = kind.__doc__.rstrip().splitlines()
    rules = [k for k, line in enumerate(lines) if line and set(line) <= {"=", " "}]
    column = lines[rules[-3] + 1].index("meaning")
    return {line.split()[0]: line[column:].strip() for line in lines[rules[-2] + 1 : rules[-1]]}


def test_every_parameter_has_a_meaning():
    def rule(kind):
        found = meanings(kind)
        assert set(found) == {field.alias for field in attrs.fields(kind) if field.init}
        assert [name for name, meaning in found.items() if not meaning] == []

    assert not offenders(rule, DECLARED)


def test_components_of_all_kinds_are_looked_at():
    names = {kind.__name__ for kind in DECLARED}
    assert names > {"CohesiveCrack", "DruckerPrager", "Voronoi", "Brazilian", "CentralDifference", "Adaptive", "Stage"}


@attrs.frozen(kw_only=True)
class Mine(gl.ContactLaw):
    """A law of a user."""

    #: stands above
    kn: float = gl.parameter("Pa/m")
    ks: float = gl.parameter("Pa/m")  #: stands beside
    # is none
    free: float = gl.parameter("1")
    stiffness = property(lambda self: (self.kn, self.ks))

    def traction(self, opening, slip):
        return self.kn * opening, self.ks * slip


def test_a_meaning_stands_beside_a_field_or_above_it():
    assert meanings(Mine) == {"kn": "stands above", "ks": "stands beside", "free": ""}


def method(name, module, file, **around):
    space = {"__name__": module, **around}
    exec(compile(f"def {name}(self):\n    return 0\n", file, "exec"), space)
    return space[name]


def test_a_class_is_written_in_the_first_file_of_its_own_methods():
    """Those of a base's module and of attrs do not count, and code from another process only if there is no other."""
    sent, here = method("a", "mine", DYNAMIC), method("c", "mine", "c.py")
    others = {"x": method("x", "theirs", "x.py"), "y": method("y", "mine", "<attrs generated methods y>")}

    def found(**methods):
        return file_of(type("Mine", (), {"__module__": "mine", **others, **methods}))

    assert found(a=sent, c=here, d=method("d", "mine", "d.py")) == "c.py"
    assert found(a=sent) == DYNAMIC
    assert found(a=method("a", "mine", DYNAMIC, __file__="a.py"), c=here) == "a.py"
    assert found() == ""
    assert file_of(type("Mine", (), {"__module__": __name__})) == __file__
