"""The signals that end what serves or looks on."""

from __future__ import annotations

import asyncio
import os
import signal

import pytest

from sacbus.signals import heed_signals


@pytest.mark.parametrize(
    ("number", "status"), [(signal.SIGINT, 130), (signal.SIGTERM, 0), (signal.SIGHUP, 129)]
)
def test_each_signal_has_its_status(number: signal.Signals, status: int) -> None:
    async def main() -> int:
        ended: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        heed_signals(ended.set_result)
        os.kill(os.getpid(), number)
        return await ended

    assert asyncio.run(main()) == status


def test_a_closed_terminal_that_nohup_has_ignored_stays_ignored() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)

    async def main() -> int:
        ended: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        heed_signals(ended.set_result)
        os.kill(os.getpid(), signal.SIGHUP)
        os.kill(os.getpid(), signal.SIGTERM)
        return await ended

    try:
        assert asyncio.run(main()) == 0
    finally:
        signal.signal(signal.SIGHUP, before)
