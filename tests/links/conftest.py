from __future__ import annotations

from collections.abc import AsyncIterator

import pytest
import pytest_asyncio

from tests.links.rig import BACKENDS, Rig, rig_of


@pytest_asyncio.fixture(params=list(BACKENDS))
async def rig(request: pytest.FixtureRequest) -> AsyncIterator[Rig]:
    async with rig_of(request.param) as rig:
        yield rig
