"""Device drivers, one module or folder per family; ``replay`` is one like the others."""
