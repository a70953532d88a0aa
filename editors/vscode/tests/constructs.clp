; SYNTAX TEST "source.clips" "the parts of CLIPS"

; a comment
; <- comment.line.semicolon.clips

(deftemplate goal (slot id (type SYMBOL)) (multislot params))
;^^^^^^^^^^^ keyword.declaration.clips
;            ^^^^ entity.name.function.clips
;                  ^^^^ storage.type.clips
;                           ^^^^ storage.type.clips

(defrule goal-expand-talk "Says (hello)"
;^^^^^^^ keyword.declaration.clips
;        ^^^^^^^^^^^^^^^^ entity.name.function.clips
;                         ^^^^^^^^^^^^^^ string.quoted.double.clips
  (declare (salience ?*SALIENCE-HIGH*))
;  ^^^^^^^ keyword.operator.word.clips
;           ^^^^^^^^ storage.type.clips
;                    ^^^^^^^^^^^^^^^^ variable.other.global.clips
  ?g <- (goal (id ?id&~nil) (params $?p ?))
; ^^ variable.other.local.clips
;    ^^ keyword.operator.arrow.clips
;        ^^^^ entity.name.tag.clips
;                 ^^^ variable.other.local.clips
;                    ^^ keyword.operator.constraint.clips
;                      ^^^ constant.language.clips
;                                   ^^^ variable.other.local.clips
;                                       ^ variable.language.wildcard.clips
  (not (plan))
;  ^^^ keyword.operator.word.clips
  (test (> -1.5e3 2))
;          ^^^^^^ constant.numeric.clips
;                 ^ constant.numeric.clips
  =>
; ^^ keyword.operator.arrow.clips
  (if (eq ?g:mode A) then (assert (x "a \" b")))
;  ^^ keyword.control.clips
;         ^^ variable.other.local.clips
;            ^^^^ variable.other.property.clips
;                    ^^^^ keyword.control.clips
;                          ^^^^^^ support.function.clips
;                                       ^^ constant.character.escape.clips
  (printout t "; no comment" crlf) ; a comment
;              ^^^^^^^^^^^^ string.quoted.double.clips
;                            ^^^^ constant.language.clips
;                                  ^^^^^^^^^^^ comment.line.semicolon.clips
  (goal-tree-2x ?x))
;  ^^^^^^^^^^^^ entity.name.tag.clips - constant.numeric.clips

(defglobal ?*A* = 3)
;^^^^^^^^^ keyword.declaration.clips
;          ^^^^ variable.other.global.clips
;                 ^ constant.numeric.clips
