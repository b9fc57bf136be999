"""From the light that reaches a lens to the bytes of a photograph, in the order of a real camera.

Lens: defocus, flare, bloom, chromatic aberration, vignetting. Exposure: time and gain. Photosites:
colour filters, dark current, photon and read noise, defects, saturation, quantisation. Development:
white balance, demosaicing, colour, tone, sharpening, JPEG. Every stage can be left out; what is
left out draws nothing and costs nothing. Ordered stages are what makes synthetic images transfer:
Carlson et al., "Modeling camera effects to improve visual learning from synthetic data", 2018.
"""
