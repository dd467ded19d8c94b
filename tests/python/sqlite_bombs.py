"""Small SQLite bags whose description or order would take much time."""

import sqlite3
from collections.abc import Callable
from functools import partial
from pathlib import Path

TABLES = """
CREATE TABLE topics (id INTEGER PRIMARY KEY, name, type, serialization_format);
CREATE TABLE messages (id INTEGER PRIMARY KEY, topic_id, timestamp, data);
INSERT INTO topics VALUES (1, '/t', 'std_msgs/msg/Float64', 'cdr');
"""

ROWS = """
INSERT INTO messages (topic_id, timestamp, data)
SELECT 1, {time}, x'' FROM (
    WITH RECURSIVE counted(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM counted LIMIT {count})
    SELECT k FROM counted
);
"""
"""Messages without content, whose times are a function of their numbers ``k``."""

ENDLESS = "WITH RECURSIVE counted(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM counted) SELECT"

DESCRIPTIONS: dict[str, str] = {
    "an endless view as the metadata of a bag": f"""{TABLES}{ROWS.format(time="k", count=3)}
        CREATE VIEW metadata AS {ENDLESS} max(k) AS metadata FROM counted;
        CREATE VIEW schema AS {ENDLESS} max(k) AS schema_version FROM counted;
        CREATE VIEW message_definitions AS {ENDLESS} max(k) AS topic_type,
        max(k) AS encoding, max(k) AS encoded_message_definition FROM counted;""",
    "an endless view as the topics of a bag": f"""{TABLES}{ROWS.format(time="k", count=3)}
        DROP TABLE topics;
        CREATE VIEW topics AS {ENDLESS} k AS id, 'n' AS name, 'n' AS type,
        'cdr' AS serialization_format FROM counted;""",
    "300 000 messages whose key is hidden": f"""{TABLES}
        ALTER TABLE messages ADD COLUMN rowid;{ROWS.format(time="k", count=300_000)}""",
    "300 000 messages of one time, with an index": f"""{TABLES}{ROWS.format(time=7, count=300_000)}
        CREATE INDEX times ON messages (timestamp);""",
    "300 000 messages of one time, index of two": f"""{TABLES}{ROWS.format(time=7, count=300_000)}
        CREATE INDEX times ON messages (timestamp, abs(1000 - id));""",
    "300 000 messages in descending order": f"""{TABLES}
        {ROWS.format(time="1000000 - k", count=300_000)}
        CREATE INDEX times ON messages (timestamp DESC);""",
    "300 000 messages with a generated column": f"""{TABLES}
        ALTER TABLE messages ADD COLUMN long AS (hex(zeroblob(10000000)));
        {ROWS.format(time="k", count=300_000)}""",
    "300 views, each twice the one before": TABLES
    + ROWS.format(time="k", count=3)
    + "CREATE VIEW v0 AS SELECT 1 AS a;"
    + "".join(
        f"CREATE VIEW v{k} AS SELECT * FROM v{k - 1} UNION ALL SELECT * FROM v{k - 1};"
        for k in range(1, 300)
    ),
    "a generated description of 1 GB": f"""{TABLES}{ROWS.format(time="k", count=3)}
        CREATE TABLE metadata (metadata, rowid AS (hex(zeroblob(90000000)) || metadata));
        INSERT INTO metadata (metadata) VALUES ('a'), ('b'), ('c'), ('d'), ('e'), ('f');""",
    "300 000 topics": f"""{TABLES}
        INSERT INTO topics (name, type, serialization_format)
        SELECT '/t' || k, 'std_msgs/msg/Float64', 'cdr' FROM (
            WITH RECURSIVE counted(k) AS (SELECT 1 UNION ALL SELECT k + 1 FROM counted LIMIT 300000)
            SELECT k FROM counted
        );{ROWS.format(time="k", count=3)}""",
}
"""Statements that create each bag."""


def write(statements: str, folder: Path) -> Path:
    """Writes a bag."""
    path = folder / "described.db3"
    with sqlite3.connect(path) as bag:
        bag.executescript(statements)
    bag.close()
    return path


DATABASES: dict[str, Callable[[Path], Path]] = {
    name: partial(write, statements) for name, statements in DESCRIPTIONS.items()
}
