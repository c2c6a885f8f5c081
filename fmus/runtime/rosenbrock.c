/* Rodas5P, a linearly implicit method of order 5 with embedded order 4 and continuous output of order 4, L-stable and
 * stiffly accurate. Coefficients: G. Steinebach, Construction of Rosenbrock-Wanner method Rodas5P and numerical
 * benchmarks within the Julia Differential Equations package, BIT Numerical Mathematics 63 (2023) 27. */
#include "linear.h"
#include "method.h"

#include <math.h>
#include <string.h>

#define STAGES 8
#define GAMMA 0.21193756319429014

/* The last two stages add the step before to the argument of stage 6, as does the result. */
static const double argument[6][5] = {
    {0.0},
    {3.0},
    {2.849394379747939, 0.45842242204463923},
    {-6.954028509809101, 2.489845061869568, -10.358996098473584},
    {2.8029986275628964, 0.5072464736228206, -0.3988312541770524, -0.04721187230404641},
    {-7.502846399306121, 2.561846144803919, -11.627539656261098, -0.18268767659942256, 0.030198172008377946},
};
static const double coupling[STAGES][STAGES - 1] = {
    {0.0},
    {-14.155112264123755},
    {-17.97296035885952, -2.859693295451294},
    {147.12150275711716, -1.41221402718213, 71.68940251302358},
    {165.43517024871676, -0.4592823456491126, 42.90938336958603, -5.961986721573306},
    {24.854864614690072, -3.0009227002832186, 47.4931110020768, 5.5814197821558125, -0.6610691825249471},
    {30.91273214028599, -3.1208243349937974, 77.79954646070892, 34.28646028294783, -19.097331116725623,
     -28.087943162872662},
    {37.80277123390563, -3.2571969029072276, 112.26918849496327, 66.9347231244047, -40.06618937091002,
     -54.66780262877968, -9.48861652309627},
};
static const double node[STAGES] = {0.0, 0.6358126895828704, 0.4095798393397535, 0.9769306725060716,
                                    0.4288403609558664, 1.0, 1.0, 1.0};
static const double by_time[STAGES] = {0.21193756319429014, -0.42387512638858027, -0.3384627126235924,
                                       1.8046452872882734, 2.325825639765069, 0.0, 0.0, 0.0};
static const double output[3][STAGES] = {
    {25.948786856663858, -2.5579724845846235, 10.433815404888879, -2.3679251022685204, 0.524948541321073,
     1.1241088310450404, 0.4272876194431874, -0.17202221070155493},
    {-9.91568850695171, -0.9689944594115154, 3.0438037242978453, -24.495224566215796, 20.176138334709044,
     15.98066361424651, -6.789040303419874, -6.710236069923372},
    {11.419903575922262, 2.8879645146136994, 72.92137995996029, 80.12511834622643, -52.072871366152654,
     -59.78993625266729, -0.15582684282751913, 4.883087185713722},
};

/* Stages are kept from row 1 on; row 0 is the slope at the start. */
static double *stage(const Integration *run, int s) { return work_stage(run, (size_t)s + 1); }

static double sum(const Integration *run, const double *weights, int count, size_t i)
{
    double total = 0.0;
    for (int j = 0; j < count; j++)
        total += weights[j] * stage(run, j)[i];
    return total;
}

/* Factors of 1/(h gamma) - df/dx; the Jacobian itself serves all attempts from the same point. */
static int prepare(Integration *run, double t, double h, const double *x)
{
    size_t n = run->n;
    double *jacobian = work_jacobian(run), *factors = work_factors(run);
    if (!run->jacobian_known && run->jacobian(run->context, t, x, jacobian, work_by_time(run)) != 0)
        return -1;
    run->jacobian_known = 1;
    for (size_t i = 0; i < n * n; i++)
        factors[i] = -jacobian[i];
    for (size_t i = 0; i < n; i++)
        factors[i * n + i] += 1.0 / (h * GAMMA);
    return linear_factorize(factors, run->pivots, n);
}

static void place(const Integration *run, int s, const double *x, double *y)
{
    for (size_t i = 0; i < run->n; i++)
        y[i] = s < 6 ? x[i] + sum(run, argument[s], s, i) : y[i] + stage(run, s - 1)[i];
}

static int attempt(Integration *run, double t, double h, double t_next, const double *x)
{
    double *y = work_end(run);
    if (prepare(run, t, h, x) != 0)
        return -1;
    for (int s = 0; s < STAGES; s++) {
        double *k = stage(run, s), at = node[s] < 1.0 ? t + node[s] * h : t_next;
        place(run, s, x, y);
        if (s == 0)
            memcpy(k, work_stage(run, 0), run->n * sizeof(double));
        else if (method_slope(run, at, y, k) != 0)
            return -1;
        for (size_t i = 0; i < run->n; i++)
            k[i] += h * by_time[s] * work_by_time(run)[i] + sum(run, coupling[s], s, i) / h;
        linear_solve(work_factors(run), run->pivots, run->n, k);
    }
    memcpy(work_error(run), stage(run, STAGES - 1), run->n * sizeof(double));
    for (size_t i = 0; i < run->n; i++)
        y[i] += work_error(run)[i];
    return 0;
}

static void inside(const Integration *run, double h, const double *x, double share, double *result)
{
    double rest = 1.0 - share;
    (void)h;
    for (size_t i = 0; i < run->n; i++) {
        double one = sum(run, output[0], STAGES, i), two = sum(run, output[1], STAGES, i);
        double three = sum(run, output[2], STAGES, i);
        result[i] = rest * x[i] + share * (work_end(run)[i] + rest * (one + share * (two + share * three)));
    }
}

/* Power iteration with the Jacobian, in units of the states' sizes: the mean growth after the first few turns. */
static double stiffness(const Integration *run, double h, const double *x)
{
    enum { WARM_UP = 4, COUNT = 8 };
    size_t n = run->n;
    double *v = work_before(run), *image = work_error(run), logarithms = 0.0;
    for (size_t i = 0; i < n; i++)
        v[i] = (i % 2 ? -1.0 : 1.0) * method_size(run, x, i);
    for (int turn = 0; turn < WARM_UP + COUNT; turn++) {
        double before = 0.0, after = 0.0;
        memset(image, 0, n * sizeof(double));
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < n; i++)
                image[i] += work_jacobian(run)[j * n + i] * v[j];
        for (size_t i = 0; i < n; i++) {
            double size = method_size(run, x, i);
            before += v[i] / size * (v[i] / size);
            after += image[i] / size * (image[i] / size);
        }
        if (!(after > 0.0) || !isfinite(after))
            return after == 0.0 ? 0.0 : -1.0;
        if (turn >= WARM_UP)
            logarithms += 0.5 * log(after / before) / COUNT;
        for (size_t i = 0; i < n; i++)
            v[i] = image[i] / sqrt(after);
    }
    return h * exp(logarithms);
}

const Method rosenbrock = {attempt, inside, stiffness, 0};
