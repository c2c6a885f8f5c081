/* An output for an input of every type; a tunable parameter is passed on too. Of FMI 3, but for what FMI 2 also has. */
struct Model {
    double time, float64_in, float64_out, tunable, tuned;
    int32_t int32_in, int32_out;
    char string_in[TEXT], string_out[TEXT];
#if FMI == 3
    bool boolean_in, boolean_out;
    int64_t enumeration_in, enumeration_out;
    float float32_in, float32_out;
    int8_t int8_in, int8_out;
    uint8_t uint8_in, uint8_out;
    int16_t int16_in, int16_out;
    uint16_t uint16_in, uint16_out;
    uint32_t uint32_in, uint32_out;
    int64_t int64_in, int64_out;
    uint64_t uint64_in, uint64_out;
    Bytes binary_in, binary_out;
#else
    int32_t boolean_in, boolean_out, enumeration_in, enumeration_out;
#endif
};
static const Variable variables[] = {
    ONE(float64_in),     ONE(float64_out),     ONE(tunable),    ONE(tuned),       ONE(int32_in),
    ONE(int32_out),      ONE(boolean_in),      ONE(boolean_out), WORDS(string_in), WORDS(string_out),
    ONE(enumeration_in), ONE(enumeration_out),
#if FMI == 3
    ONE(float32_in),     ONE(float32_out),     ONE(int8_in),    ONE(int8_out),    ONE(uint8_in),
    ONE(uint8_out),      ONE(int16_in),        ONE(int16_out),  ONE(uint16_in),   ONE(uint16_out),
    ONE(uint32_in),      ONE(uint32_out),      ONE(int64_in),   ONE(int64_out),   ONE(uint64_in),
    ONE(uint64_out),     BINARY(binary_in),    BINARY(binary_out),
#endif
};

static void reset(Model *model) { *model = (Model){.string_in = "Set me!", .enumeration_in = 1}; }
static void begin(Model *model, const char *resources) {}
static void calculate(Model *model)
{
    model->float64_out = model->float64_in;
    model->tuned = model->tunable;
    model->int32_out = model->int32_in;
    model->boolean_out = model->boolean_in;
    model->enumeration_out = model->enumeration_in;
    memcpy(model->string_out, model->string_in, TEXT);
#if FMI == 3
    model->float32_out = model->float32_in;
    model->int8_out = model->int8_in;
    model->uint8_out = model->uint8_in;
    model->int16_out = model->int16_in;
    model->uint16_out = model->uint16_in;
    model->uint32_out = model->uint32_in;
    model->int64_out = model->int64_in;
    model->uint64_out = model->uint64_in;
    model->binary_out = model->binary_in;
#endif
}
static StepResult advance(Model *model, double end) { return STEP_DONE; }
