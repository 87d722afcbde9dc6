"""From true motion to volts, edges and bytes, each as late as the real part."""
