"""The result of a run: curves, properties, cracks, and frames for pictures and VTK."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from grainlaw.arguments import Checked
from grainlaw.columns import (
    CONTACTS,
    SHEAR_CRACKS,
    SPENT,
    STAGE,
    STRAIN,
    SUPPLIED,
    TEMPERATURE,
    TENSILE_CRACKS,
    TIME,
    Panel,
    energy,
    grows,
    panels_of,
    quantity_of,
    since,
    work_done,
)
from grainlaw.contact import dilates
from grainlaw.fields import ParameterError, checked_number, checked_vector, checked_whole_number
from grainlaw.mesh import Mesh
from grainlaw.messages import nearest, refusal, short
from grainlaw.quantity import Quantity
from grainlaw.results.certificate import doubts, texts
from grainlaw.results.files import RESULT, write_atomically
from grainlaw.results.tables import data_frame
from grainlaw.short_form import html_table
from grainlaw.specimen import Specimen
from grainlaw.tessellation import INSIDE

if TYPE_CHECKING:
    import pandas

    from grainlaw.contact import Laws
    from grainlaw.drawing.figure import Figure
    from grainlaw.engine.state import State
    from grainlaw.protocol import LoadingProtocol
    from grainlaw.results.frames import Frame
    from grainlaw.results.laboratory import Laboratory
    from grainlaw.results.measure import Measure


class Named(dict[str, Any]):
    """Values by name; a name that is not there is answered with those that are."""

    def __missing__(self, name: str) -> Any:
        raise KeyError(f"there is no {name!r}{nearest(str(name), self)} (there are: {', '.join(self)})")


class Curves(Named):
    """What a test recorded: arrays of equal length (t,) by the names of their columns, SI."""

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each sample. Raises ParameterError without pandas."""
        return data_frame("Curves.to_pandas", self)


def _each(value: Any, *shape: int) -> Any:
    """Declare an array of cracks, with this value for each unless it is given."""
    return attrs.field(default=attrs.Factory(lambda self: np.full((len(self.time), *shape), value), takes_self=True))


@attrs.frozen(eq=False)
class Cracks(metaclass=Checked):
    """Broken contact points, in the order of breaking; the length of each is half of its interface."""

    position: np.ndarray  #: (k, 2) m, on the deformed specimen
    orientation: np.ndarray  #: (k,) rad from the x axis, in [0, pi)
    length: np.ndarray  #: (k,) m
    mode: np.ndarray  #: (k,) share of shear: below 0.5 tensile, else shear
    time: np.ndarray  #: (k,) s, to within one sample
    opening: np.ndarray  #: (k,) m
    slip: np.ndarray  #: (k,) m
    grains: np.ndarray  #: (k, 2) numbers of the two polygons
    spent: np.ndarray  #: (k,) J/m2, work done on it until it broke, less the elastic energy then
    inside: np.ndarray = _each(False)  #: (k,) whether between two cells of one grain: transgranular; not, unless given

    phases: np.ndarray = _each("", 2)  #: (k, 2) names of the minerals of both polygons; empty, unless given
    #: (k,) what they were: "between" grains, "inside" of one, or the name of a joint; empty, unless given
    kind: np.ndarray = _each("")
    source_opening: np.ndarray = _each(np.nan)  #: (k,) m, gained by the break, less elastic ones; nan unless given
    source_slip: np.ndarray = _each(np.nan)  #: (k,) m, from the last sample before the break till waves have left

    @property
    def _facts(self) -> dict[str, str]:
        tensile = int(np.count_nonzero(self.tensile))
        return {"cracks": str(len(self)), "tensile": str(tensile), "shear": str(len(self) - tensile)}

    def __len__(self) -> int:
        return len(self.time)

    def __getitem__(self, chosen: np.ndarray) -> Cracks:
        """A selection, by mask or numbers, such as ``cracks[cracks.tensile]``."""
        return Cracks(**{field.name: getattr(self, field.name)[chosen] for field in attrs.fields(Cracks)})

    def to_pandas(self) -> pandas.DataFrame:
        """A row for each crack, its place as x, y (m), its grains as grain_a, grain_b. Raises ParameterError."""
        return data_frame("Cracks.to_pandas", attrs.asdict(self, recurse=False))

    def by_pair(self) -> dict[tuple[str, str], Cracks]:
        """The cracks by the minerals on their two sides, in the order of the alphabet; those with the most first.

        Those between two cells of one grain have the key ``("inside", mineral)``, as laws have.
        """
        names = np.sort(self.phases, axis=1).astype(object)
        names[self.inside, 0] = INSIDE
        pairs, which = np.unique(names.astype(str), axis=0, return_inverse=True)
        order = np.argsort(-np.bincount(which.ravel(), minlength=len(pairs)), kind="stable")
        return {(str(pairs[k, 0]), str(pairs[k, 1])): self[which.ravel() == k] for k in order}

    @property
    def tensile(self) -> np.ndarray:
        """(k,) whether a crack is tensile."""
        return self.mode < 0.5


@attrs.frozen(eq=False)
class Result(metaclass=Checked):
    """The result of one test of one specimen under one law.

    Interface c joins the edge from node ``interfaces[c, 0]`` to ``interfaces[c, 1]`` of one grain to the edge from
    ``interfaces[c, 2]`` to ``interfaces[c, 3]`` of its neighbour: 0 and 2 are at the start of both edges, 1 and 3 at
    their end. It has two contact points. In the arrays ``bonds`` of a frame, that at its start is entry c, that at its
    end entry ``len(interfaces) + c``. :meth:`crack_segments` gives the lines to draw.
    """

    specimen: Specimen  #: what is tested
    law: Laws  #: one for all contacts, or by pair of phases
    protocol: LoadingProtocol  #: the test
    curves: Curves = attrs.field(converter=Curves)  #: by column name, one entry per sample, SI
    summary: dict[str, Any]  #: properties by name, SI
    cracks: Cracks  #: broken contact points
    frames: list[Frame]  #: moments of the run
    interfaces: np.ndarray  #: (c, 4) nodes: start and end on one grain, then start and end on the other
    stages: Sequence[str] = ()  #: their names, by the numbers in the curves
    begins: int = 0  #: the sample with which the test itself begins, after stages that only prepare the specimen

    @classmethod
    def from_run(
        cls, state: State, protocol: LoadingProtocol, curves: dict[str, np.ndarray], frames: list[Frame],
        seconds: float, stages: Sequence[str] = (), *, of_test: bool = True,
    ) -> Result:  # fmt: skip
        """Make the result from the state at the end of a run, with or without what the test finds ``of_test``."""
        found = protocol.summary(curves, state.specimen) if curves and of_test else {}
        if not isinstance(found, Mapping):
            raise ParameterError(f"it returned {short(found)}, not a dictionary of properties by name")
        lists = {name: value.tolist() for name, value in found.items() if isinstance(value, np.ndarray)}
        summary = Named({**found, **lists})
        summary |= {
            TENSILE_CRACKS: int(curves[TENSILE_CRACKS][-1]) if curves else 0,
            SHEAR_CRACKS: int(curves[SHEAR_CRACKS][-1]) if curves else 0,
            "steps": state.steps,
            "seconds": seconds,
            "time_step": state.time_step,
            "mass_added": state.mass_added,
            "energy_error": energy_error(curves) if curves else 0.0,
            "energy_made": energy_made(curves, frames, state.contact_lengths) if curves else 0.0,
            "energy_returned": energy_returned(curves, state) if curves else 0.0,
        }
        cracks = _cracks(state)
        if state.specimen.grains.is_breakable:
            summary["transgranular_cracks"] = int(cracks.inside.sum())
        interfaces = state.bonds.ends
        return cls(
            state.specimen, state.model.laws, protocol, Curves(curves), summary, cracks, frames, interfaces, stages,
            protocol.begins(curves) if curves else 0,
        )  # fmt: skip

    def frame(self, where: str, number: int) -> Frame:
        """One of the frames, counted from the end if negative. Raises ParameterError, which begins with ``where``."""
        count = len(self.frames)
        if not count:
            raise ParameterError(
                f"{where} needs frames, and this result has none: it was saved without them, as by a study"
            )
        return self.frames[checked_whole_number(f"{where}: frame", number, at_least=-count, at_most=count - 1)]

    def frame_before(self, where: str, since: str | None) -> Frame | None:
        """The last frame before a stage, None before the first and without a stage. Raises as :meth:`frame`."""
        if since is None:
            return None
        stages = [moment.stage for moment in self.frames]
        if since not in stages:
            known = ", ".join(dict.fromkeys(stages))
            raise refusal(f"{where}: since", since, f"a stage that frames have: {known}")
        first = stages.index(since)
        return self.frames[first - 1] if first else None

    def moved(self, place: Any, *, frame: int = -1, since: str | None = None) -> np.ndarray:
        """(2,) m: displacement at a frame of the node that is nearest to a ``place`` (x, y) m before the test.

        ``since`` names a stage, from whose beginning it counts. Raises ParameterError for a place outside the specimen
        (farther from a node than the sides of its zones are long), a frame or a stage that is not there.
        """
        moment, begin = self.frame("moved", frame), self.frame_before("moved", since)
        nodes = self.mesh.nodes
        away = np.hypot(*(nodes - checked_vector("moved: place", place)).T)
        node = int(np.argmin(away))
        at = self.mesh.zones[(self.mesh.zones == node).any(axis=1)]
        sides = nodes[at] - nodes[np.roll(at, 1, axis=1)]
        if away[node] > np.hypot(sides[..., 0], sides[..., 1]).max():
            x, y = nodes[node]
            raise refusal("moved: place", place, f"in the specimen, whose nearest node is at ({x:g}, {y:g}) m")
        return moment.displacement[node] - (begin.displacement[node] if begin else 0.0)

    def cracks_since(self, stage: str) -> Cracks:
        """Contact points that have broken since a stage began. Raises ParameterError for a stage that is not there."""
        if stage not in self.stages:
            raise refusal("cracks_since: stage", stage, f"a stage of the test: {', '.join(self.stages)}")
        before = self.curves[STAGE] < list(self.stages).index(stage)
        return self.cracks[self.cracks.time > self.curves[TIME][before].max(initial=-np.inf)]

    def contact_points(self, frame: int = -1, since: str | None = None) -> dict[str, np.ndarray]:
        """Columns (p,) of all contact points at a frame: where they are, between what, and what they bear; SI.

        Before the test: ``x``, ``y``, the middle of their half of an interface, ``length`` and ``angle`` (rad from the
        x axis) of that; ``grain_a``, ``grain_b``; ``kind``, "between" or "inside" of grains or the name of the joint;
        those of :attr:`Frame.bonds`, of which ``opening`` and ``slip`` count from the beginning of the stage ``since``.
        ``pandas.DataFrame(...)`` makes a table of them. Raises ParameterError for a frame or a stage that is not there.
        """
        moment, begin = self.frame("contact_points", frame), self.frame_before("contact_points", since)
        start, end = contact_segments(self.mesh.nodes, self.interfaces).swapaxes(0, 1)
        (x, y), along = ((start + end) / 2).T, end - start
        grains = np.tile(self.mesh.node_grain[self.interfaces[:, ::2]], (2, 1))
        names = np.array(self.specimen.grains.kinds)
        own = {name: row - begin.bonds[name] if begin and name in MOVED else row for name, row in moment.bonds.items()}
        return {
            "x": x, "y": y, "length": np.hypot(*along.T), "angle": np.arctan2(along[:, 1], along[:, 0]) % np.pi,
            "grain_a": grains[:, 0], "grain_b": grains[:, 1],
            "kind": names[np.tile(interface_kinds(self.mesh, self.interfaces), 2)], **own,
        }  # fmt: skip

    def crack_segments(self, frame: int = -1) -> np.ndarray:
        """(k, 2, 2) m, start and end of each crack at a frame, on the deformed specimen and between its two grains.

        They are in the order of ``cracks``: segment j is that of crack j. Raises ParameterError for a frame that is not
        there.
        """
        moment = self.frame("crack_segments", frame)
        time = moment.bonds["broken_time"]
        broken = np.flatnonzero(~np.isnan(time))
        in_order = broken[np.argsort(time[broken], kind="stable")]  # that of ``cracks``
        return contact_segments(self.mesh.nodes + moment.displacement, self.interfaces)[in_order]

    @property
    def _facts(self) -> dict[str, str]:
        from grainlaw.results.archive import called, law_name

        facts = {"law": law_name(self.law), "test": called(self.protocol), "grains": str(self.specimen.grains.count)}
        facts |= texts(self, [name for name in self.summary if self.quantity(name).is_main])
        samples = max(map(len, self.curves.values()), default=0)
        counts = {"samples": samples, "frames": len(self.frames)}
        return facts | {what: str(count) for what, count in counts.items()}

    def _html(self) -> str:
        cited = [("to cite", work) for work in self.specimen.cite]
        facts = (self._facts | texts(self, self.summary)).items()
        rows = [*facts, *(("doubt", words) for words in self.doubts), *cited]
        return html_table(rows, caption="Result")

    @property
    def doubts(self) -> tuple[str, ...]:
        """In words, what speaks against the numbers: checks of the certificate that failed, and what is no strength."""
        return tuple(doubts(self)) if self.curves else ()

    def __str__(self) -> str:
        return "\n".join([repr(self), *(f"doubt: {words}" for words in self.doubts)])

    def quantity(self, name: str) -> Quantity:
        """How a column or a property is shown: as the test declares it, or as of any test."""
        return quantity_of(name, self.quantities)

    def shown(self, name: str) -> np.ndarray:
        """A column of the curves in the unit in which it is shown."""
        return self.curves[name] * self.quantity(name).factor

    @cached_property
    def quantities(self) -> dict[str, Quantity]:
        """Those that the test declares, by name."""
        return {each.name: each for each in self.protocol.quantities}

    @cached_property
    def panels(self) -> Sequence[Panel]:
        """What figures draw of its curves: as the test declares it, or as of any test."""
        return panels_of(self.curves, self.protocol.panels)

    def of_test(self, over: str = STRAIN) -> Result:
        """With the curves of the test itself, counted from where it begins: what is drawn ``over`` a column.

        The whole run over time or temperature, and where the test has not begun.
        """
        if not 0 < self.begins < len(self.curves[STAGE]) or over in (TIME, TEMPERATURE):
            return self
        return attrs.evolve(self, curves=Curves(since(self.curves, self.begins, self.quantities)), begins=0)

    @property
    def course(self) -> str:
        """The column that cracks and energies are drawn over: that of the first panel, or time where it falls."""
        over = self.panels[0].over
        return over if grows(self.curves[over]) else TIME

    @property
    def mesh(self) -> Mesh:
        """Nodes, zones and interfaces of the specimen."""
        return self.specimen.mesh

    @cached_property
    def laboratory(self) -> Laboratory:
        """What a laboratory reports: thresholds, moduli, crack pattern, fragments, acoustic events, energy lost."""
        from grainlaw.results.laboratory import Laboratory

        return Laboratory(self)

    def save(self, file: str | os.PathLike[str], *, frames: bool = True) -> None:
        """Write all of it as one file of numbers, for :meth:`load`; without its ``frames`` much less. Raises OSError.

        Law and test are written as their names and parameters, never as code.
        """
        from grainlaw.results.archive import to_bytes

        content = to_bytes(self, frames=frames)
        write_atomically(Path(file), lambda path: path.write_bytes(content))

    @staticmethod
    def load(file: str | os.PathLike[str]) -> Result:
        """Read what :meth:`save` has written, or the folder of ``grainlaw test``. Raises ParameterError, OSError.

        Its law and its protocol are :class:`~grainlaw.results.archive.Recorded`, which have names and numbers alone.
        """
        from grainlaw.results.archive import from_bytes

        path = Path(file)
        if path.is_dir():
            path /= RESULT
            if not path.exists():
                raise ParameterError(
                    f"Result.load: {file} has no {RESULT}, which grainlaw test writes at its end; of a checkpoint= "
                    "simulate(..., restart=True) gives the result, and save() keeps it"
                )
        return from_bytes(path.read_bytes(), str(path))

    def write_vtk(self, folder: str | os.PathLike[str]) -> None:
        """Write ``grains.pvd``, ``cracks.pvd``, their .vtu series, and ``show_in_paraview.py``. Raises OSError."""
        from grainlaw.results.archive import law_name
        from grainlaw.results.paraview import write_script
        from grainlaw.results.vtk import VtkSeries

        self.frame("write_vtk", -1)
        series = VtkSeries(folder, self.specimen, self.interfaces, law_name(self.law))
        for frame in self.frames:
            series.write(frame, self.curves)
        write_script(folder, [[(law_name(self.law), "", self)]])

    def plot(self) -> Figure:
        """The usual picture of the test and the crack pattern. Raises ParameterError without curves."""
        from grainlaw.results.figures.curves import plot_result

        return plot_result(self)

    def animate(self, file: str | os.PathLike[str], *, per_second: float = 8.0) -> None:
        """Write the growth of the cracks, frame by frame, as an animation: a ``.gif`` or, with ffmpeg, an ``.mp4``.

        It shows ``per_second`` frames a second. Raises ParameterError for another ending, without frames, and for .mp4
        where the program ffmpeg is not installed; OSError.
        """
        from grainlaw.results.figures.cracks import animate

        checked_number("animate: per_second", per_second, above=0)
        animate(self, file, per_second)

    def write_report(
        self, file: str | os.PathLike[str], *, title: str = "", record: Mapping[str, Any] | None = None,
        incomplete: str = "", measures: Sequence[Measure] | None = None, files: Sequence[str] = (),
    ) -> None:  # fmt: skip
        """Write the laboratory report as a page of HTML.

        ``record`` says what was run, ``incomplete`` why the test did not end; ``measures`` are those of
        :class:`Laboratory` unless given.
        """
        from grainlaw.results.archive import law_name
        from grainlaw.results.figures.report import write_report

        write_report(
            {law_name(self.law): self}, file, title=title, record=record, incomplete=incomplete, measures=measures,
            files=files,
        )  # fmt: skip

    def show(self) -> None:
        """Show the last frame in a window (pyvista)."""
        from grainlaw.results.figures.curves import show_result

        show_result(self)


MOVED = ("opening", "slip")  #: of a contact point, what may count from the beginning of a stage


def interface_kinds(mesh: Mesh, interfaces: np.ndarray) -> np.ndarray:
    """(c,) numbers of the kinds of interfaces, which need not be in the order of the mesh."""
    here, there = np.lexsort(interfaces.T), np.lexsort(mesh.interfaces.T)
    kinds = np.zeros(len(interfaces), dtype=np.int64)
    kinds[here] = mesh.interface_kind[there]
    return kinds


def contact_segments(place: np.ndarray, interfaces: np.ndarray) -> np.ndarray:
    """(2c, 2, 2) m, start and end of each contact point's half interface, midway between its two grains.

    ``place`` (i, 2) m are the places of the nodes, ``interfaces`` (c, 4) their numbers as in ``Result.interfaces``.
    The contact points c at the start of all interfaces come first, then those at their end.
    """
    ends = place[interfaces]
    start, end = (ends[:, 0] + ends[:, 2]) / 2, (ends[:, 1] + ends[:, 3]) / 2
    middle = (start + end) / 2
    return np.stack([np.concatenate([start, middle]), np.concatenate([middle, end])], axis=1)


def energy_error(curves: Mapping[str, np.ndarray]) -> float:
    """Largest gap in the energy ledger, Eq. (12), over the largest external work, or that of heat."""
    gap = np.abs(energy(curves, SUPPLIED) - energy(curves, *SPENT))
    return float(np.max(gap) / max(work_done(curves), 1e-300))


def energy_made(curves: Mapping[str, np.ndarray], frames: Sequence[Frame], lengths: np.ndarray) -> float:
    """Largest energy that intact contacts, ``lengths`` (p,) m, had made in a frame, over the largest work."""
    made = max(float(frame.bonds["made"] @ lengths) for frame in frames)
    return made / max(work_done(curves), made, 1e-300)


def energy_returned(curves: Mapping[str, np.ndarray], state: State) -> float:
    """Energy that contacts have given back beyond the work done on them, over the largest work.

    The larger of two: that of contact points of bonds, each by itself, at the end; and the most of all contacts
    together. In opening and in slip by themselves, because friction hides what openings make; together where a law
    lifts its faces, for slip then pays for the opening.
    """
    together = any(map(dilates, state.model.of_bonds))
    kinds = (CONTACTS,) if together else tuple((kind,) for kind in CONTACTS)
    most = max(-float(np.min(energy(curves, *kind))) for kind in kinds)
    works = state.bonds.work * state.contact_lengths * ~np.tile(state.replaced, 2)
    works = works.sum(axis=0, keepdims=True) if together else works
    returned = max(0.0, most, -float(np.minimum(works, 0.0).sum()))
    return returned / max(work_done(curves), returned, 1e-300)


def _phase_names(specimen: Specimen) -> np.ndarray:
    """(g,) names of the minerals of the polygons."""
    grains = specimen.grains
    return np.array([grains.phase_name(k) for k in range(grains.phase.max() + 1)])[grains.phase]


def _cracks(state: State) -> Cracks:
    broken = state.breaks.in_order()
    interface = state.bonds.order[broken % len(state.bonds)]
    ends = state.positions[state.mesh.interfaces[interface]]
    source = state.source[:, broken]
    along = ends[:, 1] + ends[:, 3] - ends[:, 0] - ends[:, 2]  # of both sides together
    return Cracks(
        position=state.contact_positions[broken],
        orientation=np.arctan2(along[:, 1], along[:, 0]) % np.pi,
        length=state.contact_lengths[broken],
        mode=state.broken_mode[broken],
        time=state.broken_time[broken],
        opening=state.opening[broken].copy(),
        slip=state.slip[broken].copy(),
        grains=state.mesh.interface_grains[interface],
        inside=state.mesh.interface_kind[interface] == 1,
        kind=np.array(state.specimen.grains.kinds)[state.mesh.interface_kind[interface]],
        phases=_phase_names(state.specimen)[state.mesh.interface_grains[interface]],
        spent=state.broken_work[broken],
        source_opening=source[0],
        source_slip=source[1],
    )
