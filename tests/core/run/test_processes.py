"""Workers on this computer: what they return, say and raise is what one process would, and they end with it."""

import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest
from heard import Heard
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rail_extract.core.clouds.points import ask
from rail_extract.core.errors import Cancelled, RailExtractError
from rail_extract.core.kernels import blas, one_thread
from rail_extract.core.pipeline import Parameters, extract_files
from rail_extract.core.pipeline.sources import Classified
from rail_extract.core.run import processes as module
from rail_extract.core.run.processes import Processes, worker_count, workers
from rail_extract.core.run.tasks import Runner, Task
from rail_extract.core.run.worker import Interpreter, Worker

FUNCTIONS = """
import os, sys, threading, time
from pathlib import Path
from rail_extract.core.errors import NoTrackError

def add(number, context):
    context.progress.info(f"info {number}")
    if number % 3 == 0:
        context.progress.warning(f"warning {number}")
    return number + sum(context.results.values())

def about(context):
    print("what a library prints")
    os.system("echo and what a program prints")
    return os.getpid(), os.environ.get("OMP_NUM_THREADS")

def fail(number, after_s, context):
    time.sleep(after_s)
    context.progress.warning(f"before {number}")
    raise NoTrackError(f"task {number}")

class Odd(Exception):
    def __init__(self):
        super().__init__("odd")
        self.lock = threading.Lock()

def fail_oddly(context):
    raise Odd

def die(context):
    os._exit(9)

def die_first(file, deaths, context):
    with open(file, "a") as stream:
        stream.write(".")
    if os.path.getsize(file) <= deaths:
        os._exit(9)
    return os.path.getsize(file)

def leave(file, context):
    Path(file).write_text("")

def slow(folder, context):
    Path(folder, str(os.getpid())).write_text("")
    for number in range(600):
        context.progress.set_fraction(number / 1200)
        time.sleep(0.1)

def silent(folder, context):
    Path(folder, str(os.getpid())).write_text("")
    time.sleep(60)

def half(context):
    context.progress.status("half")
    time.sleep(0.15)
    context.progress.set_fraction(0.5)
"""


@pytest.fixture(scope="module")
def functions(tmp_path_factory):
    """A module of tasks that other processes find."""
    folder = tmp_path_factory.mktemp("functions")
    (folder / "functions_of_tasks.py").write_text(FUNCTIONS)
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(folder))
        patch.setattr(module, "WORTH_S", 0.0)
        import functions_of_tasks

        yield functions_of_tasks
    del sys.modules["functions_of_tasks"]


@pytest.fixture(scope="module")
def executor(functions):
    """Two workers."""
    executor = Processes(2, lambda: Interpreter(sys.executable))
    yield executor
    executor.end()


@pytest.fixture
def two(executor):
    """A runner with two workers."""
    return Runner(executor)


def run(runner, tasks, heard=None):
    """Return results in their order, and the error that ended the run, if one did."""
    found = []
    try:
        for one in runner.run(tasks, heard or Heard()):
            found.append(one)
    except RailExtractError as error:
        return found, str(error)
    return found, None


def is_alive(number):
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    return True


def wait_until(condition):
    end = time.monotonic() + 20
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


@st.composite
def graphs(draw):
    """For each task, by number, those before it whose results it takes."""
    count = draw(st.integers(2, 12))
    return [sorted(draw(st.sets(st.integers(0, number - 1), max_size=3))) if number else [] for number in range(count)]


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(graphs(), st.sets(st.integers(0, 11), max_size=2), st.booleans())
def test_results_messages_and_errors_come_as_from_one_process(functions, executor, graph, failing, tolerant):
    tasks = {
        number: Task(f"task {number}", functions.add, (number,), needs=tuple(inputs), returned=number % 4 != 1)
        for number, inputs in enumerate(graph)
    }
    for number in failing & set(tasks):
        tasks[number] = replace(tasks[number], function=functions.fail, arguments=(number, 0.0))
    expected, found = Heard(), Heard()
    alone, two = Runner(tolerant=tolerant), Runner(executor, tolerant=tolerant)
    assert run(two, tasks, found) == run(alone, tasks, expected)
    assert [one for one in found.said if "WORKERS" not in one[1]] == expected.said
    assert two.failures == alone.failures
    assert len(alone.failures) <= len(failing & set(tasks)) * tolerant


def test_the_first_error_counts_even_if_a_later_one_comes_sooner(functions, two, tmp_path):
    late = tmp_path / "late"
    tasks = {
        1: Task("", functions.add, (1,)),
        2: Task("", functions.fail, (2, 0.5)),
        3: Task("", functions.fail, (3, 0.0)),
        4: Task("", functions.leave, (str(late),)),
    }
    heard = Heard()
    assert run(two, tasks, heard) == ([(1, 1)], "task 2")
    assert ("warning", "before 3") not in heard.said
    assert not late.exists()


def test_an_error_that_cannot_be_sent_says_what_it_was_and_where(functions, two):
    with pytest.raises(RuntimeError, match="Odd: odd") as caught:
        list(two.run({number: Task("", functions.fail_oddly, ()) for number in range(2)}))
    (note,) = caught.value.__notes__
    assert note.startswith("In a worker process:") and "in fail_oddly" in note


def test_an_error_carries_the_traceback_of_its_worker(functions, two):
    tasks = {number: Task("", functions.fail, (number, 0.0)) for number in range(2)}
    with pytest.raises(RailExtractError) as caught:
        list(two.run(tasks))
    assert "in fail" in caught.value.__notes__[0]


def test_workers_have_one_thread_and_what_is_printed_does_no_harm(functions, two):
    found = dict(two.run({number: Task("", functions.about, (), weight=9) for number in range(4)}))
    assert {threads for _, threads in found.values()} == {"1"}
    assert os.getpid() not in {number for number, _ in found.values()}


def test_modules_of_the_current_folder_are_not_taken(functions, monkeypatch, tmp_path):
    for name in ("pickle", "signal", "rail_extract"):
        (tmp_path / f"{name}.py").write_text("raise SystemExit(1)")
    monkeypatch.chdir(tmp_path)
    with workers(2) as runner:
        assert run(runner, {number: Task("", functions.add, (number,)) for number in range(2)})[0] == [(0, 0), (1, 1)]


def test_the_progress_rises_to_the_end(functions, two):
    heard = Heard()
    list(two.run({number: Task("", functions.half, (), weight=1 + number) for number in range(4)}, heard))
    assert heard.fractions == sorted(heard.fractions)
    assert heard.fractions[-1] == pytest.approx(1.0)
    assert len(heard.fractions) == 8
    assert ("status", "half") in heard.said


def test_a_cancel_ends_the_processes(functions, tmp_path):
    heard = Heard(cancel_at=0.01)
    with workers(2) as runner:
        with pytest.raises(Cancelled):
            list(runner.run({number: Task("", functions.slow, (str(tmp_path),)) for number in range(4)}, heard))
        started = [int(file.name) for file in tmp_path.iterdir()]
        assert started
        assert not any(map(is_alive, started))


def test_a_worker_that_dies_is_named_by_its_task(functions, two):
    tasks = {1: Task("Cleaning square (0, 1)", functions.die, ()), 2: Task("", functions.add, (2,))}
    found, sentence = run(two, tasks)
    assert found == []
    assert sentence.startswith("Cleaning square (0, 1) failed, because its worker process ended: ")
    assert "set WORKERS to 1" in sentence
    assert run(two, {number: Task("", functions.add, (number,)) for number in range(2)}) == ([(0, 0), (1, 1)], None)


def test_a_task_whose_worker_ends_runs_again(functions, two, tmp_path):
    tasks = {
        number: Task(f"task {number}", functions.die_first, (str(tmp_path / f"{number}"), number))
        for number in range(3)
    }
    heard = Heard()
    assert run(two, tasks, heard) == ([(0, 1), (1, 2), (2, 3)], None)
    assert len([text for _, text in heard.said if text.startswith("A worker process ended")]) == 3


def test_a_worker_that_ends_while_it_waits_is_replaced(functions, executor):
    tasks = {number: Task("", functions.about, (), weight=9) for number in range(2)}
    numbers = [number for number, _ in dict(Runner(executor).run(tasks)).values()]
    for number in set(numbers):
        os.kill(number, signal.SIGTERM)
    time.sleep(0.2)  # or it may be given a task before it ends, as one that ends later
    later = [number for number, _ in dict(Runner(executor).run(tasks)).values()]
    assert len(later) == 2 and not set(later) & set(numbers)


def test_the_others_continue_if_a_task_ends_each_of_its_workers(functions, executor):
    tasks = {1: Task("Cleaning square (0, 1)", functions.die, ()), 2: Task("", functions.add, (2,))}
    runner = Runner(executor, tolerant=True)
    assert run(runner, tasks) == ([(2, 2)], None)
    (sentence,) = runner.failures
    assert sentence.startswith("Cleaning square (0, 1) failed, because its worker process ended: ")


KILLED = """
import os, sys
sys.path.insert(0, sys.argv[1])
import functions_of_tasks as functions
from rail_extract.core.run import processes
from rail_extract.core.run.tasks import Task
processes.WORTH_S = 0.0
with processes.workers(2) as two:
    list(two.run({number: Task("", functions.silent, (sys.argv[2],)) for number in range(2)}))
"""


@pytest.mark.skipif(sys.platform == "win32", reason="Windows has no SIGKILL")
def test_no_process_outlives_a_run_that_is_killed(functions, tmp_path):
    call = [sys.executable, "-c", KILLED, str(Path(functions.__file__).parent), str(tmp_path)]
    paths = os.pathsep.join([entry for entry in sys.path if entry])
    with subprocess.Popen(call, env={**os.environ, "PYTHONPATH": paths}) as process:
        wait_until(lambda: len(list(tmp_path.iterdir())) == 2)
        started = [int(file.name) for file in tmp_path.iterdir()]
        assert all(map(is_alive, started))
        process.send_signal(signal.SIGKILL)
    wait_until(lambda: not any(map(is_alive, started)))


def test_little_work_and_work_that_cannot_be_divided_stay_in_this_process(functions, monkeypatch):
    monkeypatch.setattr(module, "WORTH_S", 10.0)
    chain = {1: Task("", functions.about, (), weight=99), 2: Task("", functions.about, (), needs=(1,), weight=99)}
    little = {number: Task("", functions.about, (), weight=1) for number in range(4)}
    much = {number: Task("", functions.about, (), weight=9) for number in range(4)}
    monkeypatch.setenv("OMP_NUM_THREADS", "7")
    with workers(2) as runner:
        for tasks in (chain, little):
            assert {number for number, _ in dict(runner.run(tasks)).values()} == {os.getpid()}
        assert os.getpid() not in {number for number, _ in dict(runner.run(much)).values()}


def test_no_more_processes_are_started_than_there_are_tasks(functions, monkeypatch):
    started = []
    monkeypatch.setattr(module, "Worker", lambda *words: started.append(Worker(*words)) or started[-1])
    with workers(3) as runner:
        for count, expected in ((2, 2), (2, 2), (5, 3)):
            found, _ = run(runner, {number: Task("", functions.add, (number,)) for number in range(count)})
            assert found == [(number, number) for number in range(count)]
            assert len(started) == expected
    assert not any(is_alive(one.number) for one in started)


def refuse():
    raise RailExtractError("there is no Python here.")


def missing():
    return Interpreter("/nowhere/python")


def ends_at_once():
    return Interpreter("/bin/false")


@pytest.mark.parametrize("interpreter", [refuse, missing, ends_at_once])
def test_without_workers_this_process_does_the_work_and_says_why(functions, interpreter):
    heard = Heard()
    with workers(2, interpreter) as runner:
        for _ in range(2):
            found, _ = run(runner, {number: Task("", functions.add, (number,)) for number in range(2)}, heard)
            assert found == [(0, 0), (1, 1)]
    reasons = [text for _, text in heard.said if text.startswith("One process works alone")]
    assert len(reasons) == 1


def test_one_worker_is_this_process(functions):
    with workers(1) as runner:
        found = dict(runner.run({number: Task("", functions.about, (), weight=9) for number in range(2)}))
    assert {number for number, _ in found.values()} == {os.getpid()}


def test_the_number_of_workers_follows_cores_and_memory(monkeypatch):
    monkeypatch.setattr(module, "cores", lambda: 12)
    for gigabytes, most in ((1, 4), (8, 4), (16, 8), (256, 12)):
        monkeypatch.setattr(module, "memory_bytes", lambda size=gigabytes: size << 30)
        assert 2 <= worker_count(0) <= most
        assert worker_count(0) * module.WORKER_BYTES <= max(2, gigabytes / 4) * 2**30
    assert worker_count(0) == 12
    assert worker_count(40) == 40
    monkeypatch.setattr(module, "cores", lambda: 1)
    assert worker_count(0) == 1


def test_the_memory_of_this_computer_is_known():
    assert 2**28 < module.memory_bytes() < 2**46


def test_lines_are_the_same_to_the_last_bit(functions, tiles, tmp_path, difference):
    parameters = Parameters(1.435, 0.072, passes=1, engine="OPENCV", square_tiles=4, quality_step_m=1.0)
    found = []
    for count in (1, 2, 3):
        folder = tmp_path / str(count)
        folder.mkdir()
        with one_thread(*blas()), workers(count) as runner:
            found.append(extract_files(Classified(ask([tiles], [10])), folder, parameters, runner))
    assert len(found[0].rails) > 1
    for other in found[1:]:
        for name in vars(found[0]):
            assert difference(getattr(other, name), getattr(found[0], name)) is None
