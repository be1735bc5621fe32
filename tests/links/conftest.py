from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from tests.links.rig import BACKENDS, BACKENDS_THAT_TELL_ABSENCE, Rig, rig_of


@pytest_asyncio.fixture(params=BACKENDS)
async def rig(request: pytest.FixtureRequest) -> AsyncIterator[Rig]:
    with rig_of(request.param) as rig:
        yield rig


@pytest_asyncio.fixture(params=BACKENDS_THAT_TELL_ABSENCE)
async def telling_rig(request: pytest.FixtureRequest) -> AsyncIterator[Rig]:
    """A link that knows when nobody is there."""
    with rig_of(request.param) as rig:
        yield rig
