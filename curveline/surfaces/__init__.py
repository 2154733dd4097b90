"""From a surface to several displays in parallel, its lines, that show it together."""
