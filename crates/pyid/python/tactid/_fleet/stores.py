"""Object stores: S3, Google Cloud Storage, Azure and HTTP.

Credentials come from the environment, from the files of the stores' own tools or from the machine,
and are in no address, row or error.
"""

import configparser
import functools
import os
import random
import time
from collections.abc import Iterator
from datetime import timedelta
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote

from tactid._base.errors import ArgumentError
from tactid._base.files import SCHEMES
from tactid._read.packages import package

ATTEMPTS = 8
"""How often a range is asked for, from a store that is throttled or fails: for half a minute."""

FIRST_WAIT_S = 0.25
"""Time before the second attempt, s; it doubles with each further one."""


class StoreError(OSError):
    """A store that cannot be reached, or an object that is not what was listed."""


class Object(NamedTuple):
    """An object of a store."""

    name: str
    """Path below the address that was listed."""
    size: int
    """Number of bytes."""
    tag: str
    """E-tag, or the time of the last change where the store has none."""


def is_address(url: str) -> bool:
    """Returns whether a text is the address of something in a store, and not a path."""
    return "://" in url


def check_address(url: str) -> None:
    """Checks that an address is one of a store that is known, and has no credentials.

    Raises:
        ArgumentError: It is of another kind, or contains a user, a password or a signature.
    """
    # A name may contain `#`, and a pattern `?`.
    before, _, query = url.partition("?")
    scheme, _, rest = before.partition("://")
    user, _, host = rest.partition("/")[0].rpartition("@")
    shown = f"{scheme}://{host}{rest[rest.index('/') :] if '/' in rest else ''}"
    if scheme not in SCHEMES:
        schemes = ", ".join(f"{each}://" for each in SCHEMES[:-1])
        raise ArgumentError(f"{shown}: expected a path, or an address with {schemes}")
    if user or "=" in query or (query and scheme.startswith("http")):
        raise ArgumentError(
            f"{shown} is given with a user, a password or a query: credentials come from the"
            " environment or from the usual files, because an address stands in the table"
        )


def listed(url: str) -> Iterator[Object]:
    """Yields the objects below an address.

    Raises:
        StoreError: The store cannot be reached, or does not list.
    """
    try:
        for page in _store(url).list(chunk_size=1000):
            yield from map(_object, page)
    except Exception as error:
        raise _failure(url, error) from None


def found(base: str, name: str) -> Object | None:
    """Returns an object by its name; None where there is none.

    Raises:
        StoreError: The store cannot be reached.
    """
    try:
        return _object(_store(base).head(name))
    except FileNotFoundError:
        return None
    except Exception as error:
        raise _failure(f"{base}/{name}", error) from None


def read(base: str, of: Object, start: int, end: int) -> bytes:
    """Reads a range of an object.

    A throttled or failing store is asked again, later each time.

    Raises:
        StoreError: The object has changed since it was listed, or the store fails again and again.
    """
    address = f"{base}/{of.name}"
    failure: Exception = StoreError(
        f"{address}: the store ends a range of {end - start} bytes early"
    )
    for attempt in range(ATTEMPTS):
        if attempt:
            time.sleep(FIRST_WAIT_S * 2 ** (attempt - 1) * random.uniform(0.75, 1.25))
        try:
            result = _store(base, 0).get(of.name, options={"range": (start, end)})
            if _object(result.meta | {"path": of.name}) != of:
                raise StoreError(f"{address} has changed while it was read")
            body = bytes(result.bytes())
        except (StoreError, FileNotFoundError, PermissionError) as error:
            raise _failure(address, error) from None
        except Exception as error:
            if type(error).__name__ == "NotSupportedError":
                raise ArgumentError(
                    f"{address} is on a server that does not send ranges of bytes: download it,"
                    " and give the path of the file"
                ) from None
            failure = _failure(address, error)
            continue
        if len(body) == end - start:
            return body
    raise failure


def _failure(address: str, error: Exception) -> Exception:
    """Returns the error of a store as one line with the address and the reason.

    What the store says of it names the request, whose headers and query may have credentials.
    """
    if isinstance(error, StoreError | ArgumentError):
        return error
    if isinstance(error, FileNotFoundError):
        return StoreError(f"{address} is not there")
    if isinstance(error, PermissionError):
        return StoreError(f"{address} may not be read with the credentials of the environment")
    return StoreError(f"{address} cannot be read: {_reason(error)}")


def _reason(error: BaseException) -> str:
    """Says what a store has answered, without its request."""
    text = str(error)
    for status in ("503", "500", "429", "403", "401", "400"):
        if f"status code {status}" in text or f" {status} " in text:
            return f"the store answers with status {status}"
    for word, reason in _REASONS.items():
        if word in text.lower():
            return reason
    return f"the store fails ({type(error).__name__})"


_REASONS = {
    "nosuchbucket": "there is no such bucket",
    "credential": "there are no credentials in the environment",
    "error sending request": "the store cannot be reached",
    "body error": "the store ends its answer early",
    "timed out": "the store does not answer in time",
}
"""Reasons by words in the error of a store."""


def _object(meta: Any) -> Object:
    # Azure lists tags without the quotes with which it answers reads.
    tag = str(meta["e_tag"] or meta["last_modified"].isoformat()).strip('"')
    return Object(meta["path"], int(meta["size"]), tag)


@functools.lru_cache(maxsize=64)
def _store(base: str, most_retries: int = 8) -> Any:
    """Returns the store of the objects below an address, whose connections are kept."""
    store = package("obstore.store", base)
    retries = {"max_retries": most_retries, "retry_timeout": timedelta(seconds=60)}
    client = {"timeout": "60s", "allow_http": base.startswith("http://") or _may_be_plain()}
    if base.startswith("http"):
        return store.HTTPStore.from_url(base, client_options=client, retry_config=retries)
    scheme, _, path = base.partition("://")
    base = f"{scheme}://{quote(path)}"  # a name may contain `?` and `#`
    config = _aws_files() if base.startswith("s3") else {}
    return store.from_url(base, config=config, client_options=client, retry_config=retries)


def _may_be_plain() -> bool:
    """Returns whether the environment permits a store without TLS, or names such an endpoint."""
    if os.environ.get("AWS_ENDPOINT_URL", os.environ.get("AWS_ENDPOINT", "")).startswith("http://"):
        return True
    given = (os.environ.get(f"{each}_ALLOW_HTTP", "") for each in ("AWS", "AZURE", "GOOGLE"))
    return any(value.lower() in ("1", "true") for value in given)


def _aws_files() -> dict[str, str]:
    """Returns what the files of AWS's tools say, where the environment has no key."""
    if "AWS_ACCESS_KEY_ID" in os.environ:
        return {}
    profile, home = os.environ.get("AWS_PROFILE", "default"), Path("~/.aws").expanduser()
    has_region = "AWS_REGION" in os.environ or "AWS_DEFAULT_REGION" in os.environ
    found: dict[str, str] = {}
    for variable, name, section, keys in (
        ("AWS_CONFIG_FILE", "config", f"profile {profile}", () if has_region else ("region",)),
        (
            "AWS_SHARED_CREDENTIALS_FILE",
            "credentials",
            profile,
            ("aws_access_key_id", "aws_secret_access_key", "aws_session_token"),
        ),
    ):
        file = configparser.RawConfigParser()
        file.read(os.environ.get(variable, home / name))
        section = section if file.has_section(section) else profile
        for key in keys:
            if file.has_option(section, key):
                found[key.removeprefix("aws_")] = file.get(section, key)
    return found
