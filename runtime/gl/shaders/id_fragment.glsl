// Which triangle a sample shows, from 1 (a visibility buffer: Burns and Hunt 2013). All that is done per triangle:
// rasterising in software runs this for whole blocks of pixels, however small the triangle.
layout(location = 0) out float id; // exact up to 2^24
void main() { id = float(gl_PrimitiveID + 1); }
