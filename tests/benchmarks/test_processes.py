"""The processes of the benchmarks end with the program that started them."""

import os
import subprocess
import sys
from pathlib import Path

FOLDER = Path(__file__).resolve().parents[2] / "benchmarks"

PROGRAM = """
import os, time
from processes import processes

if __name__ == "__main__":
    pool = processes(1)
    print(pool.submit(os.getpid).result(), flush=True)
    pool.submit(time.sleep, 600)
    time.sleep(600)
"""


def test_a_process_ends_when_the_program_that_started_it_is_killed(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": str(FOLDER)}
    parent = subprocess.Popen([sys.executable, program], stdout=subprocess.PIPE, env=environment, text=True)
    number = int(parent.stdout.readline())
    assert number != parent.pid
    parent.kill()
    try:
        parent.communicate(timeout=60)  # the output ends with the last process that has it
    except subprocess.TimeoutExpired:
        os.kill(number, 9)
        raise
