"""The functions of the package, and the results that they return."""
