"""The page to click through: whole, without network, below 5 MB; and in a browser, where there is one."""

import re
import shutil
import subprocess
from types import SimpleNamespace

import attrs
import numpy as np
import pytest
from support import BRITTLE, PULL, small_sample

import grainlaw as gl
from grainlaw.results.figures import interactive

pytest.importorskip("bokeh")
BROWSER = shutil.which("chromium") or shutil.which("google-chrome")

#: moves the slider, points at the first crack that was followed, and writes what is then shown into the title
CLICKED = """
<script>
setTimeout(() => {
  const models = [...Bokeh.documents.flatMap(d => [...d._all_models.values()])];
  const slider = models.find(m => m.type == "Slider"), hover = models.find(m => m.type == "HoverTool" && m.callback);
  const cracks = hover.callback.args.cracks, path = hover.callback.args.path;
  slider.value = MOMENT;
  setTimeout(() => {
    const k = cracks.data.followed.indexOf(1);
    hover.callback.execute(hover, {index: {indices: [k]}});
    setTimeout(() => {
      const found = [cracks.data.x0.length, cracks.data.point[k], path.data.point[0], path.data.slip.length];
      document.body.setAttribute("data-found", found.join(" "));
    }, 200);
  }, 200);
}, 1500);
</script>
"""


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    probe = gl.Probe(first=3)
    result = gl.simulate(small_sample(30), BRITTLE, PULL, frames=8, observers=[probe])
    file = tmp_path_factory.mktemp("page") / "page.html"
    gl.write_interactive(result, file, probe=probe)
    return result, probe, file


def broken_at(result, moment):
    return np.flatnonzero(~np.isnan(result.frames[moment].bonds["broken_time"]))


def test_the_page_stands_alone(made):
    text = made[2].read_text("utf-8")
    assert made[2].stat().st_size < 5e6
    outside = re.sub(r"<script.*?</script>", "", text, flags=re.S)
    assert len(outside) < 10_000
    assert not re.search(r"\b(src|href)=|url\(", outside)
    assert not re.search(r"<script[^>]*\bsrc=", text[text.rindex("<script") :])
    assert "Uniaxial tension: MohrCoulomb" in text


def test_what_it_holds_is_what_the_result_has(made):
    result, probe, _ = made
    tables = interactive._tables(result, interactive._chosen(result), probe.paths)
    moments, cracks = tables["moments"], tables["cracks"]
    assert len(moments["x"]) == len(result.frames)
    for k, frame in enumerate(result.frames):
        broken = broken_at(result, k)
        assert moments["cracks"][k] == len(broken)
        rows = slice(moments["first"][k], moments["first"][k] + len(broken))
        assert np.array_equal(cracks["point"][rows], broken)
        assert cracks["slip"][rows] == pytest.approx(frame.bonds["slip"][broken] * 1e6, rel=1e-6)
    assert moments["y"][-1] == pytest.approx(result.curves["stress"][-1] / 1e6)
    ends = np.column_stack([cracks[name][rows] for name in ("x0", "y0", "x1", "y1")]).reshape(-1, 2, 2)
    order = np.argsort(frame.bonds["broken_time"][broken], kind="stable")
    assert ends[order] == pytest.approx(result.crack_segments() * 1e3, rel=1e-5)
    ring = interactive._ring(result)
    assert np.count_nonzero(ring < 0) == result.specimen.grains.count
    assert set(tables["paths"]["point"]) == {path.point for path in probe.paths}


def test_the_curve_is_in_the_units_of_its_axes(made):
    """Nominal stress in MPa over strain in per cent or per mille, as the headings of the axes say."""
    from bokeh.models import ColumnDataSource

    result = made[0]
    moments = interactive._tables(result, interactive._chosen(result), {})["moments"]
    drawn, marks = interactive._curve(result, ColumnDataSource(moments))
    line = drawn.renderers[0].data_source.data
    assert "MPa" in drawn.yaxis[0].axis_label
    assert line["y"] == pytest.approx(result.curves["stress"] / 1e6, rel=1e-6)
    assert np.interp(moments["x"], line["x"], line["y"]) == pytest.approx(moments["y"], rel=1e-3)
    assert {name: mark.tolist() for name, mark in marks.data.items()} == {
        "x": [moments["x"][-1]], "y": [moments["y"][-1]]
    }  # fmt: skip


def test_it_opens_at_the_last_moment_and_the_first_path(made):
    result, probe, _ = made
    slider, _, specimen, pull, shear = interactive._panels(result, probe.paths)
    assert (slider.start, slider.end, slider.value) == (0, len(result.frames) - 1, len(result.frames) - 1)
    assert slider.title == "axial strain (%)"
    assert slider.format.args["moments"].data["x"][-1] == pytest.approx(100 * result.curves["strain"][-1])
    rims, cracks = (each.data_source.data for each in specimen.renderers)
    last, first = result.frames[-1], probe.paths[0]
    place = (result.mesh.nodes + last.displacement) * 1e3
    assert [np.nanmin(rims["x"]), np.nanmax(rims["y"])] == pytest.approx([place[:, 0].min(), place[:, 1].max()])
    assert np.array_equal(cracks["point"], broken_at(result, -1))
    for figure, along, traction in ((pull, "opening", "normal"), (shear, "slip", "shear")):
        data = figure.renderers[0].data_source.data
        assert data[along][-1] == pytest.approx(1e6 * getattr(first, along)[-1])
        assert data[traction].max() == pytest.approx(getattr(first, traction).max() / 1e6, rel=0.1)
        assert set(data["point"]) == {first.point}
    assert pull.title.text == f"contact point {first.point}"
    assert len(interactive._panels(result, [])) == 3
    one, *_ = interactive._panels(attrs.evolve(result, frames=result.frames[-1:]), [])
    assert (one.start, one.end, one.value) == (0, 1, 0)


def test_a_large_specimen_shows_fewer_moments(made, monkeypatch):
    result, _, _ = made
    monkeypatch.setattr(interactive, "MOST_BYTES", 8 * len(interactive._ring(result)) * 3)
    chosen = interactive._chosen(result)
    assert len(chosen) <= 3
    assert chosen[-1] == len(result.frames) - 1


@pytest.mark.skipif(BROWSER is None, reason="no browser")
def test_it_shows_cracks_and_paths_in_a_browser(made, tmp_path):
    result, probe, file = made
    moment = next(k for k in range(len(result.frames)) if set(broken_at(result, k)) & {p.point for p in probe.paths})
    page = tmp_path / "page.html"
    before, after = file.read_text("utf-8").rsplit("</body>", 1)
    page.write_text(f"{before}{CLICKED.replace('MOMENT', str(moment))}</body>{after}", "utf-8")
    done = subprocess.run(
        [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0",
         "--host-resolver-rules=MAP * ~NOTFOUND", "--virtual-time-budget=6000", "--dump-dom", page.as_uri()],
        capture_output=True, text=True, timeout=120,
    )  # fmt: skip
    said = [line for line in done.stderr.splitlines() if "CONSOLE" in line and "[bokeh " not in line]
    assert not said
    count, point, followed, samples = map(int, re.search(r'data-found="([^"]*)"', done.stdout).group(1).split())
    assert count == len(broken_at(result, moment)) < len(broken_at(result, -1))
    assert point == followed
    assert 2 < samples <= interactive.MOST_SAMPLES


def test_what_it_needs_is_said(made, monkeypatch, tmp_path):
    with pytest.raises(gl.ParameterError, match="write_interactive needs frames"):
        gl.write_interactive(attrs.evolve(made[0], frames=[]), tmp_path / "page.html")
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(gl.ParameterError, match=r"pip install 'grainlaw\[report\]'"):
        gl.write_interactive(made[0], tmp_path / "page.html")
    assert not list(tmp_path.iterdir())


def test_a_page_needs_the_last_frame_and_curves():
    asked = []
    bare = SimpleNamespace(frame=lambda who, number: asked.append((who, number)), curves={})
    with pytest.raises(gl.ParameterError, match="write_interactive: the result has no curves"):
        interactive.write_interactive.__wrapped__(bare, "page.html")
    assert asked == [("write_interactive", -1)]
