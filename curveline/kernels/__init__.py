"""How kernels, the functions in which the time goes, become machine code: shipped as such, or compiled when called."""
