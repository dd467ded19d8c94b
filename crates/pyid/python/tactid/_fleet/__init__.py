"""Identification of many recordings: a fleet of robots, a data set, a bucket."""
