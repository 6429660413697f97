"""Cluster of dask.distributed, as an executor of concurrent.futures."""

import logging
from collections.abc import Iterator
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from typing import Any, cast

from common.errors import ConfigurationError, FeelaheadError
from common.extras import require_packages
from feelahead.lab.scheduler import Scheduler

_CONNECT_S = "10s"


@contextmanager
def cluster(scheduler: Scheduler, own_file: str | None) -> Iterator[Executor]:
    """Yield an executor on the workers of a dask scheduler; ConfigurationError if none answers there.

    own_file: file of a user's own question, which is sent to the workers; None for a question of feelahead.
    """
    require_packages("--scheduler", "distributed", extra="experiments")
    import distributed  # noqa: PLC0415  # large
    from distributed.comm.core import CommClosedError  # noqa: PLC0415

    for name in ("distributed", "distributed.client"):  # the import sets their levels; errors are raised below
        logging.getLogger(name).setLevel(logging.CRITICAL)
    address, security = scheduler.address, None
    if scheduler.key is not None:
        security = distributed.Security(  # type: ignore[no-untyped-call]
            require_encryption=True,
            tls_ca_file=str(scheduler.authority),
            tls_client_cert=str(scheduler.certificate),
            tls_client_key=str(scheduler.key),
        )
    try:
        client: Any = distributed.Client(address, timeout=_CONNECT_S, set_as_default=False, security=security)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        raise ConfigurationError(
            f"--scheduler {address}: no dask scheduler {'with these certificates ' if security else ''}answers there; "
            "valid: a running scheduler's address, such as tcp://127.0.0.1:8786"
        ) from error
    try:
        if own_file is not None:
            client.upload_file(own_file)
        yield cast(Executor, client.get_executor(pure=False, retries=2))
    except (CancelledError, CommClosedError, distributed.KilledWorker) as error:
        raise FeelaheadError(f"--scheduler {address}: the scheduler or its workers are gone") from error
    finally:
        client.close(timeout=1)
