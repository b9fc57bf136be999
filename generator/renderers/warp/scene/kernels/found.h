wp::vec_t<6, double> found;
found[0] = strike.t;
found[1] = strike.u;
found[2] = strike.v;
found[3] = strike.face;
found[4] = body;
return found;
