"""A Dask cluster of many machines for joblib: found, and refused where it would not give the same results."""

from __future__ import annotations

import asyncio
from collections.abc import Iterator, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import joblib

from stairlab.agents import PACKAGES

DASK_TIMEOUT = 10
""" How long a scheduler may take to answer, or to have a worker [s] """


@contextmanager
def dask_cluster(address: str) -> Iterator[None]:
    """Let joblib spread its work over a Dask cluster.

    Parameters
    ----------
    address : str
        Of the scheduler, such as tcp://host:8786.

    Raises
    ------
    OSError
        If no scheduler answers within ten seconds, it has no workers, or it is lost.
    ValueError
        If the address is not like that, or a worker has other versions of the packages that results depend on.
    ImportError
        If distributed is not installed.
    """
    with _dask_client(address) as client, joblib.parallel_config("dask", client=client):
        try:
            yield
        except CancelledError:
            raise OSError(
                f"the Dask scheduler at {address} was lost; the same command goes on where this one was"
            ) from None


def _dask_client(address: str) -> Any:
    """Connect to a Dask cluster, and refuse one that would not give the same results."""
    try:
        from distributed import Client
    except ImportError:
        raise ImportError("A Dask cluster needs distributed: pip install 'stairlab[cluster]'.") from None
    if not _is_scheduler(address):
        raise OSError(f"no Dask scheduler answers at {address}; start one with: dask scheduler")
    client = Client(address, set_as_default=False)
    try:
        client.wait_for_workers(1, timeout=DASK_TIMEOUT)
        _check_versions(client.get_versions(packages=list(PACKAGES)), PACKAGES)
    except BaseException as error:
        client.close()
        if isinstance(error, TimeoutError):
            raise OSError(
                f"the scheduler has no workers; start some with: dask worker {address} --nworkers -1 --nthreads 1"
            ) from None
        raise
    return client


def _is_scheduler(address: str) -> bool:
    """Ask who is there; a Dask client would wait for ever for a server of another kind."""
    from distributed import Security, rpc

    async def ask() -> str:
        async with rpc(address, connection_args=Security().get_connection_args("client")) as there:
            return (await there.identity())["type"]

    def answer() -> str:
        return asyncio.run(asyncio.wait_for(ask(), DASK_TIMEOUT))

    try:
        with ThreadPoolExecutor(1) as thread:  # this one may have a running event loop, as in Jupyter
            return thread.submit(answer).result() == "Scheduler"
    except OSError:  # such as a TimeoutError
        return False
    except ValueError as error:
        raise ValueError(
            f"address must be that of a Dask scheduler, such as tcp://host:8786, not {address!r}: {error}"
        ) from None


def _check_versions(versions: Any, packages: Sequence[str]) -> None:
    """Refuse workers whose packages differ from ours."""
    here = versions["client"]["packages"]
    for worker, there in versions["workers"].items():
        for package in packages:
            if (found := there["packages"].get(package)) != here[package]:
                raise ValueError(
                    f"the worker {worker} has {package} {found or 'not'} where this process has {here[package]}: results would depend "
                    "on where they are made; install the same versions everywhere"
                )
