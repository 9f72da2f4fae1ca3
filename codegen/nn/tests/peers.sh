#!/bin/sh
# sh codegen/nn/tests/peers.sh CHECKOUT: the recurrent layers of a checkout of github.com/correlllab/nn4mc_py, with its
# placeholders filled in, put to the compiler. Needs arm-none-eabi-gcc.
set -eu
templates=$1/nn4mc/generator/code_generator/templates/c_standard
[ -d "$templates" ] || { echo "$1: there is no $templates" >&2; exit 1; }
command -v arm-none-eabi-gcc > /dev/null || { echo "SKIPPED: arm-none-eabi-gcc is not here" >&2; exit 0; }
work=$(mktemp -d)
trap 'rm -r "$work"' EXIT
for file in include/activations.h include/functions.h include/layers/gru.h include/layers/lstm.h \
    src/layers/gru.cpp src/layers/lstm.cpp; do
    sed '/BEGIN_INITIALIZE/,$d; /_DEFINITION_TEMPLATE/d; s/<%LAYER_DATATYPE_DELIMITER>/float/g
        s/<%WEIGHT_DATATYPE_DELIMITER>/const float/g; s/<%INDEX_DATATYPE_DELIMITER>/int/g
        s/<%ACTIVATION_DATATYPE_DELIMITER>/char/g' "$templates/$file.template" > "$work/$(basename "$file")"
done
for layer in gru lstm; do
    echo "== $layer"
    arm-none-eabi-gcc -fsyntax-only -mcpu=cortex-m4 -mfloat-abi=hard -mfpu=fpv4-sp-d16 -x c "$work/$layer.cpp" 2>&1 |
        grep error || echo "compiles: count it"
done
