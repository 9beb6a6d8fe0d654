"""The word list: what it refuses and what it leaves alone."""

import pytest
import words


@pytest.mark.parametrize(
    "sentence",
    ["This is no LAS file.", "Results don't hang on it.", "20 points a metre", "dropped, for they are short", "anew"],
)
def test_a_phrase_is_found_with_its_line(sentence):
    assert [one.split()[0] for one in words.findings("page.md", f"Fine.\n{sentence}\n")] == ["page.md:2"]


@pytest.mark.parametrize(
    "sentence",
    ["There is no scheduler at this address.", "The file is no longer open.", "for example, a line", "per metre"],
)
def test_plain_sentences_pass(sentence):
    assert words.findings("page.md", sentence) == []


def test_of_a_module_comments_and_strings_count_and_names_do_not():
    source = 'stretch = 1  # anew\ndef f():\n    """Tell whether."""\n'
    assert words.findings("module.py", source) == [
        "module.py:1 'anew': again",
        "module.py:3 'Tell whether': return, state, show",
    ]
