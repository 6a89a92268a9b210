// Depths that mark pixels, so that later passes skip all others before anything is computed; 0 where nothing is asked
// for. A pass is drawn between two marks and takes the pixels at or beyond it: no two depths need be equal.
const float kAllMarked = 0.125; // a pass
const float kWholeMark = 0.25;  // one surface fills the pixel
const float kMixedOnly = 0.375; // a pass
const float kMixedMark = 0.5;   // several surfaces do
