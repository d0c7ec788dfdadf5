"""A package that is missing is told with the extra that installs it."""

import pytest

from pneumorph.base.optional_package import optional_package


def test_the_message_says_what_needs_it_and_how_to_get_it() -> None:
    with pytest.raises(
        ModuleNotFoundError,
        match=r"^films need none, which is not installed; .* pip install 'pneumorph\[meshing\]'$",
    ):
        optional_package("no_such_package", "films need none", "meshing")
    assert optional_package("json", "files need json", "meshing").dumps([1]) == "[1]"
