"""Random faults in the source, one at a time, and whether the tests of the file notice.

    python tests/release/faults.py --learn
    python tests/release/faults.py [--seed 1] [--count 150] [--limit 120] [--only engine,laws]

Run it in a clone of its own, in whose environment grainlaw (editable), coverage and pytest-cov are installed: files
are changed and put back. ``--learn`` runs the tests that every change passes, and keeps which of them ran which line
and how long each took. A fault is shown to the tests that run its line, the quickest first. Compiled lines run
unseen: those are shown to the tests that bear the name of the file, that import it, or that say the names it defines;
of a module that no test knows, those of the modules that import it. Last come the tests of the file that take longer.
One process runs them until one fails or ``--limit`` (s) is over. A fault that survives is a hole in the tests, or no
fault: look at each.
"""

import argparse
import ast
import functools
import math
import os
import random
import re
import signal
import subprocess
import sys
import time
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCES = ("framework", "laws", "geometry", "protocols")
MOST = 8  #: files of tests for one fault
FARTHER = 5.0  #: times as long as its own does a test of another file seem to take
LINES, TIMES = ROOT / ".coverage", ROOT / "tests.xml"  #: what was learned: tests by line, their times
COVERAGE = ROOT / ".coveragerc"
OPERATORS = {ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult}
COMPARISONS = {
    ast.Lt: ast.GtE, ast.Gt: ast.LtE, ast.LtE: ast.Gt, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq,
}  # fmt: skip
EXTREMES = {"min": "max", "max": "min"}
FOR_THE_EYE = ("plot", "draw", "label", "animate", "__str__", "__repr__", "_html", "words", "figure")
PASSES, JUDGE = (
    ("engine/step", "engine/parts", "engine/contacts"),
    "test_reference_step",
)  #: runs them beside plain loops


# --- faults -----------------------------------------------------------------------------------------------------------


def changed(node):
    """Another node in place of one, or None where there is no fault to make."""
    match node:
        case ast.BinOp() if type(node.op) in OPERATORS and not isinstance(node.left, ast.Constant | ast.JoinedStr):
            return ast.BinOp(node.left, OPERATORS[type(node.op)](), node.right)
        case ast.Compare() if type(node.ops[0]) in COMPARISONS:
            return ast.Compare(node.left, [COMPARISONS[type(node.ops[0])](), *node.ops[1:]], node.comparators)
        case ast.Call(func=ast.Name(id="min" | "max" as name)):
            return ast.Call(ast.Name(EXTREMES[name]), node.args, node.keywords)
        case ast.Constant(value=float() as value) if value != 0 and not is_tolerance(value):
            return ast.Constant(1.3 * value)
        case ast.UnaryOp(op=ast.USub() | ast.Not()):
            return node.operand
        case ast.BoolOp():
            return ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
    return None


def is_tolerance(value):
    """A power of ten that is far from 1: a third more of it is no fault."""
    power = math.log10(abs(value))
    return abs(power) >= 6 and power == round(power)


def places(text):
    """Nodes in functions that a fault can be made of, with the function."""
    found = {}
    for function in ast.walk(ast.parse(text)):
        if not isinstance(function, ast.FunctionDef) or function.name.startswith(FOR_THE_EYE):
            continue
        said = (n for n in ast.walk(function) if isinstance(n, ast.Raise | ast.JoinedStr | ast.AnnAssign))
        spared = {id(inner) for outer in said for inner in ast.walk(outer)}
        body = (node for statement in function.body for node in ast.walk(statement))
        found |= {id(node): (node, function) for node in body if id(node) not in spared and changed(node)}
    return list(found.values())


def with_fault(text, rng):
    """The text with a fault, what it is, and its lines: those of the fault, and those of the body of its function."""
    node, function = rng.choice(places(text))
    new, lines = ast.unparse(changed(node)), [line.encode() for line in text.splitlines(keepends=True)]
    first = sum(map(len, lines[: node.lineno - 1])) + node.col_offset
    last = sum(map(len, lines[: node.end_lineno - 1])) + node.end_col_offset
    whole = b"".join(lines)
    what = f"{node.lineno}, {function.name}: {ast.unparse(node)[:70]} -> {new[:70]}"
    lines = range(node.lineno, node.end_lineno + 1), range(function.body[0].lineno, function.end_lineno + 1)
    return (whole[:first] + b"(" + new.encode() + b")" + whole[last:]).decode(), what, lines


# --- the tests of a file ----------------------------------------------------------------------------------------------


@functools.cache
def tests():
    """Texts of the files of tests, by file."""
    files = sorted(ROOT.glob("tests/**/test_*.py"))
    return {file: file.read_text(encoding="utf-8") for file in files}


@functools.cache
def sources():
    return {file: file.read_text(encoding="utf-8") for room in SOURCES for file in sorted(ROOT.glob(f"{room}/**/*.py"))}


def module(file):
    parts = file.relative_to(ROOT).with_suffix("").parts
    return ".".join(["grainlaw", *(parts[1:] if parts[0] == "framework" else parts)])


def defined(text):
    """Names that a module defines and that are no word of every day."""
    kinds = ast.FunctionDef | ast.ClassDef
    names = [node.name for node in ast.parse(text).body if isinstance(node, kinds)]
    return [name for name in names if not name.startswith("_") and (len(name) > 7 or not name.islower())]


@functools.cache
def helpers():
    """Texts of what tests share, by the name that they import it by."""
    files = [file for file in sorted(ROOT.glob("tests/**/*.py")) if not file.stem.startswith(("test_", "conftest"))]
    return {file.stem: file.read_text(encoding="utf-8") for file in files}


def scores(file):
    """How much each file of tests seems to be about a source, by file."""
    found, words = {}, set(defined(sources()[file]))
    said = {name: 2 * bool(words & set(re.findall(r"\w+", text))) for name, text in helpers().items()}
    for test, text in tests().items():
        name = set(test.stem.split("_"))
        score = 6 * (test.stem == f"test_{file.stem}") + 3 * (file.stem in name or {*file.stem.split("_")} <= name)
        score += 4 * bool(re.search(rf"\b{re.escape(module(file))}\b", text))
        score += min(4, len(words & set(re.findall(r"\w+", text))))
        score += 4 * (file.parent.name == "cli" and bool(re.search(rf'invoke\(\s*"{file.stem}"', text)))  # a command
        score += max((said[name] for name in re.findall(r"^from (\w+) import", text, re.M) if name in said), default=0)
        if test.stem == JUDGE and any(each in str(file) for each in PASSES):
            score = 20
        if score:
            found[test] = score - 0.5 * ("validation" in test.parts)
    return found


def tests_of(file):
    """Files of tests, the likeliest first."""
    found, known, near = scores(file), {file}, {file}
    while len(found) < 3 and near:  # then those of who imports it
        names = [module(each).rsplit(".", 1) for each in near]
        said = [re.compile(rf"from {re.escape(m)}\.{s} import|from {re.escape(m)} import .*\b{s}\b") for m, s in names]
        near = {each for each, text in sources().items() if any(r.search(text) for r in said)} - known
        known |= near
        for each in near:
            for test, score in scores(each).items():
                found[test] = max(found.get(test, 0), score / 4)
    return sorted(found, key=lambda test: (-found[test], test))[:MOST]


# --- the tests of a line ----------------------------------------------------------------------------------------------


def learn():
    """Runs the tests that every change passes, and keeps which of them ran which line, and their times."""
    folders = "".join(f"\n    {room}" for room in SOURCES)
    COVERAGE.write_text(f"[run]\nrelative_files = True\nsource = {folders}\n", encoding="utf-8")
    options = ("--cov", f"--cov-config={COVERAGE}", "--cov-context=test", "--cov-report=", f"--junitxml={TIMES}")
    subprocess.run([sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *options], cwd=ROOT, check=True)


@functools.cache
def times():
    """Seconds that each test took, by its address."""
    cases = ElementTree.parse(TIMES).iter("testcase")
    return {f"{c.get('classname').replace('.', '/')}.py::{c.get('name')}": float(c.get("time")) for c in cases}


@functools.cache
def tests_by_line(file):
    """Addresses of the tests that ran a line, by line."""
    from coverage import CoverageData

    data = CoverageData(str(LINES))
    data.read()
    seen = data.contexts_by_lineno(str(file.relative_to(ROOT)))
    return {line: {test.split("|")[0] for test in tests if test} for line, tests in seen.items()}


def tests_of_lines(file, lines):
    """Addresses of the tests that ran the fault, or else its function: the quickest first, sooner those of its file."""
    seen, near = tests_by_line(file), {str(test.relative_to(ROOT)) for test in tests_of(file)}
    for some in lines:
        if found := set().union(*(seen.get(line, set()) for line in some)) & times().keys():
            return sorted(found, key=lambda test: times()[test] * (1 if test.split("::")[0] in near else FARTHER))
    return []


# --- a trial ----------------------------------------------------------------------------------------------------------


def noticed(file, lines, limit):
    """Whether tests fail: "noticed", "survived" or "too long", with the first that failed and the time (s)."""
    began = time.monotonic()
    files, known, quick = tests_of(file), tests_of_lines(file, lines), "not (thorough or alone or slow)"
    for tests, tier in ((known or files, quick), (files, "thorough and not slow")):
        ended, first = tried(tests, tier, limit - (time.monotonic() - began))
        if ended != "survived":
            break
    return ended, f"{len(known)} {first}", time.monotonic() - began


def tried(tests, tier, limit):
    options = ("-x", "-n", "0", "-p", "no:cacheprovider", "-m", tier)
    if not tests:  # pytest would run all
        return "survived", ""
    process = subprocess.Popen(
        [sys.executable, "-m", "pytest", *options, *map(str, tests)], cwd=ROOT, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        said = process.communicate(timeout=max(limit, 1.0))[0]
        ended = {0: "survived", 5: "survived"}.get(process.returncode, "noticed")  # 5: none of this tier
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        said, ended = process.communicate()[0], "too long"
    if "ERROR: not found" in said:
        raise RuntimeError(f"what was learned is of other tests: run --learn again\n{said[-2000:]}")
    return ended, next((line for line in said.splitlines() if line.startswith(("FAILED", "ERROR"))), "")[:100]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--count", type=int, default=150)
    parser.add_argument("--limit", type=float, default=120.0, help="s for the tests of a fault")
    parser.add_argument("--only", default="", help="words of which one is in the path, by commas")
    parser.add_argument("--learn", action="store_true", help="keep which tests run which line")
    given = parser.parse_args()
    if given.learn:
        learn()
        return
    rng, counts, done = random.Random(given.seed), Counter(), set()
    rooms = {}
    for file in sources():
        if any(word in str(file.relative_to(ROOT)) for word in given.only.split(",")) and places(sources()[file]):
            rooms.setdefault(file.parent, []).append(file)
    order = sorted(rooms)
    while sum(counts.values()) < given.count:
        file = rng.choice(rooms[order[sum(counts.values()) % len(order)]])
        text, what, lines = with_fault(sources()[file], rng)
        if (file, what) in done:
            order.append(order.pop(sum(counts.values()) % len(order)))  # a room of few faults gives its turn away
            continue
        done.add((file, what))
        file.write_text(text, encoding="utf-8")
        try:
            ended, first, seconds = noticed(file, lines, given.limit)
        finally:
            file.write_text(sources()[file], encoding="utf-8")
        counts[ended] += 1
        print(f"{ended:9} {file.relative_to(ROOT)}:{what} | {first} ({seconds:.0f} s)", flush=True)
    print(dict(counts))


if __name__ == "__main__":
    main()
