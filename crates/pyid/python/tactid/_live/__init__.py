"""The identification of a robot that runs: its topics, or a recording that is played."""
