from __future__ import annotations

from collections.abc import AsyncIterator, Iterator

import pytest
import pytest_asyncio

from tests.links.rig import BACKENDS, Rig, rig_of
from tests.links.servers import KINDS, AnyServer
from tests.links.socat import Wire


@pytest_asyncio.fixture(params=list(BACKENDS))
async def rig(request: pytest.FixtureRequest) -> AsyncIterator[Rig]:
    async with rig_of(request.param) as rig:
        yield rig


@pytest.fixture(params=[name for name, kind in BACKENDS.items() if "serves many" in kind.can])
def kind(request: pytest.FixtureRequest) -> str:
    name = request.param
    assert isinstance(name, str)
    return name


@pytest.fixture
def server(kind: str) -> type[AnyServer]:
    return KINDS[kind][0]


@pytest.fixture
def wire() -> Iterator[Wire]:
    """An adapter that is plugged in."""
    wire = Wire()
    try:
        wire.plug()
        yield wire
    finally:
        wire.close()
