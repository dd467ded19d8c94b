"""A store with the protocol of S3 on the loopback, which can be slow, failing and deceitful."""

import functools
import hashlib
import socket
import threading
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import parse_qs, unquote, urlsplit
from xml.sax.saxutils import escape

SECRET = "AbCdSecretKey0123456789"
BUCKET = "fleet"

Fault = Callable[["Request"], str | None]
"""Returns what is wrong with the answer to a request: ``503``, ``reset``, ``truncated`` or a new
content for ``changed``; None where nothing is."""


@dataclass(frozen=True)
class Request:
    """A request of an object's bytes."""

    key: str
    start: int
    number: int
    """How many requests of this key there were before."""


@dataclass
class Store:
    """The objects of a bucket, and what was asked for."""

    url: str = ""
    objects: dict[str, bytes] = field(default_factory=dict)
    fault: Fault = lambda _: None
    requests: Counter[str] = field(default_factory=Counter)
    is_azure: bool = False
    """Whether the tags of a list have no quotes, as those of Azure."""
    sent: Counter[str] = field(default_factory=Counter)
    """Bytes that were sent of each object."""

    @property
    def environment(self) -> dict[str, str]:
        """What a client of the store has in its environment."""
        return {
            "AWS_ACCESS_KEY_ID": "AKIAFLEET",
            "AWS_SECRET_ACCESS_KEY": SECRET,
            "AWS_REGION": "eu-central-1",
            "AWS_ENDPOINT_URL": self.url,
            "AWS_ALLOW_HTTP": "true",
        }


@functools.lru_cache(maxsize=16)
def tag_of(content: bytes) -> str:
    return f'"{hashlib.md5(content).hexdigest()}"'


@contextmanager
def serving() -> Iterator[Store]:
    """Serves a bucket while the block runs."""
    store = Store()

    def listed_tag(content: bytes) -> str:
        return tag_of(content).strip('"') if store.is_azure else tag_of(content)

    class Handler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def log_message(self, *_: object) -> None:
            pass

        def do_HEAD(self) -> None:
            self._object(head=True)

        def do_GET(self) -> None:
            parts = urlsplit(self.path)
            if parts.path.split("/")[1] != BUCKET:
                self._answer(404, b"<Error><Code>NoSuchBucket</Code></Error>")
            elif "list-type" in parse_qs(parts.query):
                self._list(parse_qs(parts.query).get("prefix", [""])[0])
            else:
                self._object(head=False)

        def _list(self, prefix: str) -> None:
            entries = "".join(
                f"<Contents><Key>{escape(key)}</Key><LastModified>2026-01-01T00:00:00.000Z"
                f"</LastModified><ETag>{escape(listed_tag(content))}</ETag><Size>{len(content)}</Size>"
                "<StorageClass>STANDARD</StorageClass></Contents>"
                for key, content in sorted(store.objects.items())
                if key.startswith(prefix)
            )
            self._answer(
                200,
                f'<?xml version="1.0"?><ListBucketResult><Name>{BUCKET}</Name>'
                f"<IsTruncated>false</IsTruncated>{entries}</ListBucketResult>".encode(),
            )

        def _answer(self, status: int, body: bytes, **headers: str) -> None:
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name.replace("_", "-"), value)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def _object(self, *, head: bool) -> None:
            key = unquote(urlsplit(self.path).path).removeprefix(f"/{BUCKET}/")
            if key not in store.objects:
                self._answer(404, b"")
                return
            content = store.objects[key]
            given = self.headers.get("Range", "bytes=0-").removeprefix("bytes=")
            first, _, last = given.partition("-")
            start, end = int(first), min(int(last or len(content)) + 1, len(content))
            fault = None
            if not head:
                fault = store.fault(Request(key, start, store.requests[key]))
                store.requests[key] += 1
            if fault == "503":
                self._answer(503, b"<Error><Code>SlowDown</Code></Error>")
                return
            if fault == "reset":
                self._hang_up()
                return
            if fault == "changed":
                content = store.objects[key] = content[:-1] + b"!"
            self._send(key, content, (start, end), head=head, cut=fault == "truncated")

        def _hang_up(self) -> None:
            self.wfile.flush()
            self.connection.shutdown(socket.SHUT_RDWR)
            self.close_connection = True

        def _send(
            self, key: str, content: bytes, part: tuple[int, int], *, head: bool, cut: bool
        ) -> None:
            start, end = part
            body = content[start:end]
            self.send_response(200 if head else 206)
            self.send_header("ETag", tag_of(content))
            self.send_header("Last-Modified", "Thu, 01 Jan 2026 00:00:00 GMT")
            self.send_header("Content-Length", str(len(content) if head else len(body)))
            self.send_header("Content-Range", f"bytes {start}-{end - 1}/{len(content)}")
            self.end_headers()
            if head:
                return
            if cut:
                self.wfile.write(body[: len(body) // 2])
                self._hang_up()
                return
            store.sent[key] += len(body)
            self.wfile.write(body)

    server = ThreadingHTTPServer(("127.0.0.1", 0), Handler)
    server.daemon_threads = True
    store.url = f"http://127.0.0.1:{server.server_port}"
    thread = threading.Thread(target=server.serve_forever, daemon=True)
    thread.start()
    try:
        yield store
    finally:
        server.shutdown()
        server.server_close()
        thread.join()
