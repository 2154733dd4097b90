"""The operating system as curveline meets it: files, processes, what one system has and another lacks. Knows no rod."""
