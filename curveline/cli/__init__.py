"""The command line: the only package that prints, prompts or exits. It parses, calls and prints."""
