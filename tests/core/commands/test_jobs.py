import os
import signal

import pytest
from rail_extract.core.commands.jobs import Console
from rail_extract.core.errors import Cancelled


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interrupt_counts_even_where_its_exception_is_lost():
    class Finalized:
        def __del__(self):
            os.kill(os.getpid(), signal.SIGINT)
            sum(range(1000))  # the interpreter calls the handler between two instructions

    before = signal.getsignal(signal.SIGINT)
    try:
        console = Console()
        console.check()
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), signal.SIGINT)
        other = Console()
        other.check()
        Finalized()
        with pytest.raises(Cancelled):
            other.check()
    finally:
        signal.signal(signal.SIGINT, before)
