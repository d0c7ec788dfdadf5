"""The verbs of the command line, one a file, in the order of the data flow."""
