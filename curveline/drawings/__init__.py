"""Where drawn curves come from: files of points, lines and pictures, and formulas; and where they are put."""
