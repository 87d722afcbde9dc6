"""S3 and compatible stores, read by pyarrow where s3fs is missing.

Keys, region and another server's address come from where every tool of S3 has them: the variables
AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY, AWS_REGION, AWS_ENDPOINT_URL, or ~/.aws.
"""

from __future__ import annotations

import importlib.util
import os
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import fsspec
from fsspec.implementations.arrow import ArrowFSWrapper

if TYPE_CHECKING:
    from pyarrow.fs import S3FileSystem

_CONNECT_S, _ANSWER_S = 10.0, 60.0


class ArrowS3(ArrowFSWrapper):  # type: ignore[misc]  # fsspec has no types
    """An S3 store with the interface of fsspec."""

    protocol = "s3"

    def __init__(self, **options: object) -> None:
        super().__init__(arrow_s3(), **options)


def arrow_s3(**options: object) -> S3FileSystem:
    """Return the store that the environment names."""
    from pyarrow.fs import S3FileSystem

    named = os.environ.get("AWS_ENDPOINT_URL_S3") or os.environ.get("AWS_ENDPOINT_URL")
    if named:
        parts = urlsplit(named)
        options |= {"scheme": parts.scheme or "https", "endpoint_override": parts.netloc}
    return S3FileSystem(connect_timeout=_CONNECT_S, request_timeout=_ANSWER_S, **options)


def provide_s3() -> None:
    """Let fsspec read ``s3://`` without s3fs; with it nothing changes."""
    if importlib.util.find_spec("s3fs") is None:
        fsspec.register_implementation("s3", ArrowS3, clobber=True)
