"""What all other modules may use: values, names, findings, errors, files, the terminal."""
