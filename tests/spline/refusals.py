"""What every refusal must look like: a BvbError of one line, 'WHAT. WHAT TO DO.'"""

import re
from collections.abc import Callable

import pytest

from bvbedit import BvbError

WHAT_THEN_WHAT_TO_DO = re.compile(r".*\S\. [A-Z]\S* .*\.", re.DOTALL)


def refusal(call: Callable[[], object]) -> str:
    """Return the message with which ``call`` is refused."""
    with pytest.raises(BvbError) as error:
        call()
    message = str(error.value)
    assert "\n" not in message
    assert len(message) < 400
    assert WHAT_THEN_WHAT_TO_DO.fullmatch(message), message
    return message
