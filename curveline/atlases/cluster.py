"""The workers of a Dask cluster, as those who do tasks: each with the same curveline as here, or none is asked.

A task says for which curveline it is, so that a worker that joins later and has another one does nothing wrong. What a
worker leaves undone when it dies, others do; where none is left, that is said after a while.
"""

from __future__ import annotations

import logging
import re
import time
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from typing import TYPE_CHECKING, Any

from curveline._version import __version__
from curveline.atlases.tasks import Doer, SharedTask, perform
from curveline.errors import CurvelineError, InvalidInput, MissingExtra
from curveline.kernels.cache import source_digest

if TYPE_CHECKING:
    from distributed import Client, Future

PATIENCE_S = 5.0
"""How long a scheduler may take to answer, or to have any workers."""
LOOK_S = 1.0
"""How often it is looked whether there still are workers, while they are waited for."""
ADDRESS = re.compile(r"(tcp|tls)://\S+:\d+")
LOGGING = "distributed", "tornado"
HINT = "start it with `dask scheduler`, and workers with `dask worker ADDRESS`"


@contextmanager
def connected(address: str) -> Iterator[Doer]:
    """What has the workers of the scheduler at an address do tasks; the connection ends with the context.

    MissingExtra without distributed, InvalidInput for no address, CurvelineError for a scheduler that does not answer,
    has no workers, or some with another curveline.
    """
    if not ADDRESS.fullmatch(address):
        raise InvalidInput(f"{address!r} is no address of a scheduler", "write it as tcp://HOST:PORT")
    make = _client_class()
    with _quiet(), _client(make, address) as client:
        _check_workers(client, address)

        def done(tasks: Sequence[SharedTask]) -> Iterator[Any]:
            waiting = client.map(partial(perform_as, identity()), tasks, pure=False)
            waiting.reverse()
            while waiting:
                yield _result_of(client, waiting.pop(), address)

        yield done


def identity() -> str:
    """What the results of a curveline depend on: its version, and the digest of the sources of its physics."""
    return f"{__version__} {source_digest()}"


def perform_as(wanted: str, task: SharedTask) -> Any:
    """What comes of a task; CurvelineError by another curveline than the wanted one."""
    if identity() != wanted:
        raise _unlike(identity())
    return perform(task)


def _client_class() -> type[Client]:
    try:
        from distributed import Client
    except ImportError:
        raise MissingExtra(
            "clusters need dask and distributed, which are not installed", hint="pip install 'curveline[cluster]'"
        ) from None
    made: type[Client] = Client
    return made


@contextmanager
def _quiet() -> Iterator[None]:
    """Nothing of what distributed logs about connections that end, and of what it warns of other versions of itself."""
    names = [name for name in logging.Logger.manager.loggerDict if name.partition(".")[0] in LOGGING]
    logs = [log for log in map(logging.getLogger, names) if log.handlers]
    before = [log.handlers for log in logs]
    for log in logs:
        log.handlers = [logging.NullHandler()]
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for log, handlers in zip(logs, before, strict=True):
            log.handlers = handlers


@contextmanager
def _client(make: type[Client], address: str) -> Iterator[Client]:
    try:
        client = make(address, timeout=PATIENCE_S, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        raise CurvelineError(f"no scheduler answers at {address}", HINT.replace("ADDRESS", address)) from error
    try:
        yield client
    finally:
        client.close(timeout=PATIENCE_S)


def _check_workers(client: Client, address: str) -> None:
    """CurvelineError unless there are workers, all with this curveline."""
    try:
        client.wait_for_workers(1, timeout=PATIENCE_S)
        answers = client.run(identity, on_error="return")
    except TimeoutError as error:
        raise CurvelineError(f"the scheduler at {address} has no workers", HINT.replace("ADDRESS", address)) from error
    except ImportError as error:
        raise _unlike("") from error
    for answer in answers.values():
        if answer != identity():
            raise _unlike(answer if isinstance(answer, str) else "")


def _unlike(theirs: str) -> CurvelineError:
    """The complaint about a worker with another curveline, by its identity; empty for one that has none to tell."""
    version = theirs.partition(" ")[0]
    what = "has no curveline that can do this" if not theirs else f"has curveline {version}, built otherwise"
    if theirs and version != __version__:
        what = f"has curveline {version}"
    return CurvelineError(f"a worker {what}; here is {__version__}", "install the same curveline for all workers")


def _result_of(client: Client, future: Future, address: str) -> Any:
    """What came of a task; CurvelineError where the cluster cannot tell."""
    from concurrent.futures import CancelledError as Cancelled

    from distributed import CancelledError, KilledWorker
    from distributed.comm import CommClosedError

    seen = time.monotonic()
    while True:
        try:
            return future.result(timeout=LOOK_S)
        except TimeoutError:
            try:
                seen = time.monotonic() if client.nthreads() else seen
            except (OSError, CommClosedError) as error:
                raise CurvelineError(f"the scheduler at {address} is gone", "start it again") from error
            if time.monotonic() - seen > PATIENCE_S:
                hint = "start others, with more memory if they were killed"
                raise CurvelineError(f"the workers of {address} are gone", hint) from None
        except KilledWorker as error:
            hint = "their memory may be short: see their logs"
            raise CurvelineError("workers died over the same task, one after another", hint) from error
        except (CancelledError, Cancelled, CommClosedError, OSError) as error:
            raise CurvelineError(f"the scheduler at {address} is gone", "start it again") from error
