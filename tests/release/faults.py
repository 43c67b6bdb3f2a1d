"""Random faults in the source, one at a time, and whether the tests of the file notice.

    python tests/release/faults.py --learn
    python tests/release/faults.py [--seed 1] [--count 150] [--limit 120] [--only engine,laws]

Run it in a clone of its own, in whose environment grainlaw (editable), coverage and pytest-cov are installed: files
are changed and put back. ``--learn`` runs the tests that every change passes, and keeps which of them ran which line
and how long each took. Tests are collected once; a fault is put into the functions of a forked process, which shows it
to the tests that run its line, the quickest first. What they do not notice is put into the file, and shown to the tests
that bear the name of the file, that import it, or that say the names it defines (of a module that no test knows, those
of the modules that import it): compiled lines run unseen, and some tests start processes of their own or take longer.
Tests run until one fails or ``--limit`` (s) is over. A fault that survives is a hole in the tests, or no fault: look at
each.
"""

import argparse
import ast
import functools
import gc
import importlib
import math
import os
import random
import re
import select
import signal
import subprocess
import sys
import time
import types
import xml.etree.ElementTree as ElementTree
from collections import Counter
from pathlib import Path

import pytest

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
PICTURES = ("figure", "drawing/", "plot")  #: in them numbers are looks
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


def places(file):
    """Nodes in functions of a file that a fault can be made of, with the function."""
    found, text = {}, sources()[file]
    draws = any(word in str(file.relative_to(ROOT)) for word in PICTURES)
    for function in ast.walk(ast.parse(text)):
        if not isinstance(function, ast.FunctionDef) or function.name.startswith(FOR_THE_EYE):
            continue
        said = (n for n in ast.walk(function) if isinstance(n, ast.Raise | ast.JoinedStr | ast.AnnAssign))
        spared = {id(inner) for outer in said for inner in ast.walk(outer)}
        if draws:  # the width of a line, the size of a text, the share of a page
            spared |= {id(n) for n in ast.walk(function) if isinstance(n, ast.Constant)}
        body = (node for statement in function.body for node in ast.walk(statement))
        found |= {id(node): (node, function) for node in body if id(node) not in spared and changed(node)}
    return list(found.values())


def with_fault(file, rng):
    """A file's text with a fault, what it is, and its lines: those of the fault, and those of its function's body."""
    node, function = rng.choice(places(file))
    text = sources()[file]
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
        used = Counter(re.findall(r"\w+", text))
        score += min(4, len(words & set(used))) + min(used[file.stem], 30) / 10
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


# --- in the functions of a process ------------------------------------------------------------------------------------


def outermost(tree, line):
    """The qualified name of the outermost function that has a line."""
    names = []
    while True:
        inside = (n for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef) and line in lines_of(n))
        if (node := next(inside, None)) is None:
            return ""
        names.append(node.name)
        if isinstance(node, ast.FunctionDef):
            return ".".join(names)
        tree = node


def lines_of(node):
    return range(node.lineno, node.end_lineno + 1)


def code_named(code, name, line):
    """The code of a name in that of a module: of several, as a property and its setter, the one that has the line."""
    inner = [each for each in code.co_consts if isinstance(each, types.CodeType)]
    own = [each for each in inner if each.co_qualname == name and each.co_firstlineno <= line]
    return own[-1] if own else next((found for each in inner if (found := code_named(each, name, line))), None)


def same_place(one, other):
    same = (one.co_qualname, one.co_firstlineno) == (other.co_qualname, other.co_firstlineno)
    return same and Path(one.co_filename).resolve() == Path(other.co_filename)


def put_into_functions(file, text, line):
    """Gives the functions of this process the code of a text, and forgets what was kept; whether there was one."""
    name = outermost(ast.parse(text), line)
    code = code_named(compile(text, str(file), "exec", dont_inherit=True), name, line) if name else None
    importlib.import_module(module(file).removesuffix(".__init__"))
    functions = (each for each in gc.get_objects() if isinstance(each, types.FunctionType)) if code else ()
    own = [each for each in functions if same_place(each.__code__, code)]
    for each in own:
        each.__code__ = code.replace(co_freevars=each.__code__.co_freevars)
    for each in gc.get_objects():
        if isinstance(each, functools._lru_cache_wrapper) and str(each.__module__).startswith("grainlaw"):
            each.cache_clear()
    return bool(own)


def tell_first_failure(pipe, items, fault):
    """Runs tests in a forked process, and writes which failed first; nothing that was compiled here is kept."""
    from _pytest.runner import runtestprotocol

    from grainlaw.compiler.cache import _Files

    os.setsid()
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1), os.dup2(null, 2)
    if "compiler" not in str(fault[0]):
        _Files.save = lambda *_: None
    if put_into_functions(*fault):
        for item, after in zip(items, [*items[1:], None], strict=True):
            if any(report.failed for report in runtestprotocol(item, log=False, nextitem=after)):
                os.write(pipe, item.nodeid.encode())
                break
    os._exit(0)


def forked(items, fault, limit):
    """The first of the tests that fails with a fault in a forked process, or nothing."""
    reads, writes = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            tell_first_failure(writes, items, fault)
        except BaseException as error:
            os.write(writes, f"raised {type(error).__name__}".encode())
        finally:
            os._exit(0)
    os.close(writes)
    ended = select.select([reads], [], [], max(limit, 0.0))[0]
    said = os.read(reads, 4096).decode() if ended else ""
    os.close(reads)
    os.killpg(process, signal.SIGKILL) if os.getpgid(process) == process else os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    return said


# --- a trial ----------------------------------------------------------------------------------------------------------


def noticed(items, file, text, lines, limit):
    """Whether tests fail: "noticed", "survived" or "too long", with the first that failed and the time (s)."""
    began = time.monotonic()
    known = [items[test] for test in tests_of_lines(file, lines) if test in items]
    first, ended = forked(known, (file, text, lines[0].start), limit) if known else "", "noticed"
    if not first:
        file.write_text(text, encoding="utf-8")
        try:
            ended, first = tried(tests_of(file), "not alone and not slow", limit - (time.monotonic() - began))
        finally:
            file.write_text(sources()[file], encoding="utf-8")
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


class Trial:
    """What pytest does with the tests that it has collected, in place of running them."""

    def __init__(self, given):
        self.given = given

    def pytest_runtestloop(self, session):
        items, counts = {item.nodeid: item for item in session.items}, Counter()
        for file, text, what, lines in drawn(self.given):
            ended, first, seconds = noticed(items, file, text, lines, self.given.limit)
            counts[ended] += 1
            print(f"{ended:9} {file.relative_to(ROOT)}:{what} | {first} ({seconds:.0f} s)", flush=True)
        print(dict(counts))
        return True


def drawn(given):
    """Faults, room after room: file, its text with the fault, what it is, and its lines."""
    rng, done, rooms = random.Random(given.seed), set(), {}
    for file in sources():
        if any(word in str(file.relative_to(ROOT)) for word in given.only.split(",")) and places(file):
            rooms.setdefault(file.parent, []).append(file)
    order = sorted(rooms)
    while len(done) < given.count:
        file = rng.choice(rooms[order[len(done) % len(order)]])
        text, what, lines = with_fault(file, rng)
        if (file, what) in done:
            order.append(order.pop(len(done) % len(order)))  # a room of few faults gives its turn away
            continue
        done.add((file, what))
        yield file, text, what, lines


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
    else:
        os.chdir(ROOT)
        pytest.main(["-n", "0", "-p", "no:cacheprovider", "-p", "no:faulthandler"], plugins=[Trial(given)])


if __name__ == "__main__":
    main()
