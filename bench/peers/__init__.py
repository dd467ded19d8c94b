"""Comparisons of tactid with other libraries; `make bench-peers` runs them."""
